//! Symbols, identifiers, units and sign conventions (documentation only).
//!
//! | symbol | identifier | unit | meaning |
//! |---|---|---|---|
//! | f | `frequency` | Hz | frequency, always in cycles per second |
//! | omega | `omega` | rad/s | angular frequency |
//! | lambda | `lambda` | 1 | non-dimensional frequency, lambda^4 = omega^2 rho A L^4 / (E I) |
//! | zeta | `damping_ratio` | 1 | viscous damping ratio of a mode |
//! | L | `length` | m | length of the beam; of a lap joint: both halves together |
//! | E I | `bending_stiffness` | N m2 | modulus times second moment of area |
//! | rho A | `mass_per_length` | kg/m | density times cross-section |
//! | Kt, Kr, Ktr | `kt`, `kr`, `ktr` | N/m, N m/rad, N/rad | joint stiffnesses |
//! | Kx, Ky, Kz | `kx`, `ky`, `kz` | 1 | Kt L^3/(E I), Kr L/(E I), Ktr L^2/(E I) |
//! | N | `block` | samples | block size; N/2.56 lines are displayed |
//! | T | `duration` | s | length of signal in a block; 1/T is the resolution |
//!
//! # Conventions
//!
//! - Time dependence e^{+j omega t}. A signal delayed by d has the phase -omega d.
//! - Cross spectrum of force f and response x: G_fx = conj(F) X; H1 = G_fx / G_ff.
//! - Everything inside is in SI units and `f64`; other units exist only where text is read
//!   or written.
//! - Positions are measured along the beam from the joint (lap joint, free beam: from the left
//!   end). Rotation is theta = dw/dx.
//! - The joint's compliance matrix for (force, moment) -> (w, theta) is
//!   `[[1/Kt, -1/Ktr], [-1/Ktr, 1/Kr]]`: a softer root, where elasticity reaches into the
//!   support, has Ktr < 0.
