//! Theory: beams, joints and their natural frequencies. Pure functions of geometry; sees no data.
