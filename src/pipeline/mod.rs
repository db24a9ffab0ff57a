//! The whole chain as one library call.
