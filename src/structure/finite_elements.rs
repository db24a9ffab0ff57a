//! Finite-element models of the same structures, independent of the closed form.
