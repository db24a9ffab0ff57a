//! Where measurement and theory meet: joint stiffness from natural frequencies.
