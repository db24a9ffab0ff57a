//! A table of a batch as a file, of either format.

#[cfg(feature = "parquet")]
use crate::parquet_table::ParquetWriter;
use crate::record::BatchRecord;
use crate::tables::{TableKind, TableWriter};
use std::io::{self, BufWriter, Write};

/// True in a build that reads and writes Parquet.
pub const HAS_PARQUET: bool = cfg!(feature = "parquet");

/// What to do where a build lacks the feature `parquet`.
pub const WITHOUT_PARQUET: &str = "this build of tapjoint has no Parquet; build it with `cargo build --release --features parquet`, or use the command of the Python package";

/// A table that is being written.
#[derive(Debug)]
pub enum TableFile<W: Write + Send> {
    /// Comma separated values.
    Csv(Box<TableWriter<BufWriter<W>>>),
    /// Parquet.
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetWriter<W>>),
}

impl<W: Write + Send> TableFile<W> {
    /// Begins a table of comma separated values. `carried` names the carried columns of the input table.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn csv(kind: TableKind, carried: &[String], to: W) -> io::Result<Self> {
        let table = TableWriter::new(kind, carried, BufWriter::new(to))?;
        Ok(Self::Csv(Box::new(table)))
    }

    /// Begins a Parquet table. `carried` names the carried columns of the input table.
    ///
    /// # Errors
    /// The file cannot be written, or this build has no Parquet.
    pub fn parquet(kind: TableKind, carried: &[String], to: W) -> io::Result<Self> {
        #[cfg(feature = "parquet")]
        return Ok(Self::Parquet(Box::new(ParquetWriter::new(
            kind, carried, to,
        )?)));
        #[cfg(not(feature = "parquet"))]
        {
            let _ = (kind, carried, to);
            Err(io::Error::other(WITHOUT_PARQUET))
        }
    }

    /// Writes the rows of the next record.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, record: &BatchRecord) -> io::Result<()> {
        match self {
            Self::Csv(table) => table.add(record),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.add(record),
        }
    }

    /// Writes what is still held back.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> io::Result<()> {
        match self {
            Self::Csv(table) => table.finish(),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.finish(),
        }
    }
}
