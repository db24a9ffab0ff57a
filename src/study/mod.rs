//! Studies that need measurement and theory together.
