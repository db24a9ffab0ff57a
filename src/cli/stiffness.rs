//! A joint's stiffness on the command line.

use super::arguments::{CrossStiffness, Stiffness};
use anyhow::{anyhow, bail};
use clap::Args;
use tapjoint::description::JointKind;
use tapjoint::structure::JointStiffness;

/// A joint instead of the described one.
#[derive(Debug, Args)]
pub(super) struct StiffnessArguments {
    /// Translational stiffness, 0 to inf (non-dimensional); default: kt of TEST
    #[arg(long, value_name = "N", requires = "ky", allow_negative_numbers = true)]
    kx: Option<Stiffness>,
    /// Rotational stiffness, 0 to inf (non-dimensional); default: kr of TEST
    #[arg(long, value_name = "N", requires = "kx", allow_negative_numbers = true)]
    ky: Option<Stiffness>,
    /// Cross-coupling stiffness, negative for a soft root (non-dimensional); default: no coupling
    #[arg(long, value_name = "N", requires = "kx", allow_negative_numbers = true)]
    kz: Option<CrossStiffness>,
}

impl StiffnessArguments {
    /// The joint that --kx, --ky and --kz give; `None` without them.
    ///
    /// # Errors
    /// A free beam, a lap joint's coupling, a joint that would be a source of energy.
    pub(super) fn given(&self, kind: JointKind) -> anyhow::Result<Option<JointStiffness>> {
        let Some((Stiffness(kx), Stiffness(ky))) = self.kx.zip(self.ky) else {
            return Ok(None);
        };
        if kind == JointKind::Free {
            bail!("a free beam has no joint; leave out --kx, --ky and --kz");
        }
        let Some(CrossStiffness(kz)) = self.kz else {
            return Ok(Some(JointStiffness::two_parameter(kx, ky)));
        };
        if kind == JointKind::Lap {
            bail!("a lap joint has no coupling stiffness; leave out --kz");
        }
        // A passive joint's compliance matrix is positive definite: 1/Kz^2 < 1/(Kx Ky). Taken as a
        // quotient of roots, because products of large stiffnesses overflow.
        let ratio = (kx / kz.abs()) * (ky / kz.abs());
        if kz.is_finite() && (ratio.is_nan() || ratio >= 1.0) {
            let limit = kx.sqrt() * ky.sqrt();
            return Err(anyhow!(
                "--kz {kz} makes the joint a source of energy; its size must exceed sqrt(kx ky) = {limit:.6}"
            ));
        }
        Ok(Some(JointStiffness::three_parameter(kx, ky, kz)))
    }
}
