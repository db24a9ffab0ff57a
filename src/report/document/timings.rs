//! What the stages of a command took. The command line measures it.

use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_analysis::Stage;

/// What a command took, up to the moment at which this document was written.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct TimingsSection {
    /// Stages that the command went through, in their order.
    pub stages: Vec<StageTiming>,
    /// Everything between the stages. Its peak memory is null.
    pub other: Timing,
    /// The whole command: the sum of times, and the peak memory of the process.
    pub total: Timing,
}

/// What one stage took.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct StageTiming {
    /// The stage.
    pub stage: Stage,
    /// Time and memory.
    #[serde(flatten)]
    pub timing: Timing,
}

/// Time and memory.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Timing {
    /// Wall time (s). Stages that run at the same time share it equally.
    pub wall_seconds: f64,
    /// Processor time of all threads (s), shared in the same way; null where the system does not tell it.
    pub processor_seconds: Option<f64>,
    /// Most memory that the process held at once, from its start to the end of the stage (byte); null where the system does
    /// not tell it.
    pub peak_bytes: Option<u64>,
}
