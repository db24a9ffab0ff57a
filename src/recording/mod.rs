//! Reading recordings: WAV and CSV time series as physical quantities.
