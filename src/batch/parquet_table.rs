//! Tables of a batch as Parquet, and input tables that are Parquet.
//!
//! The unit of a column stands in the metadata of its field, as `unit`. Apache Arrow's schema carries it: pyarrow shows it
//! as `schema.field("frequency_Hz").metadata`. The columns are those of the comma separated tables.

use crate::record::BatchRecord;
use crate::tables::{Cell, CellKind, TableKind};
use arrow_array::{ArrayRef, Float64Array, RecordBatch, StringArray, UInt64Array};
use arrow_schema::{DataType, Field, Schema};
use bytes::Bytes;
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field as Value;
use std::io::{self, Write};
use std::sync::Arc;

/// Rows that are turned into columns at once.
const ROWS_AT_ONCE: usize = 4096;
/// Most rows of a row group. A group is held in memory until it is full.
const GROUP_ROWS: usize = 1 << 16;

/// Writes one table as Parquet, record by record.
#[derive(Debug)]
pub struct ParquetWriter<W: Write + Send> {
    kind: TableKind,
    schema: Arc<Schema>,
    /// Records so far.
    count: u64,
    rows: Vec<Vec<Cell>>,
    writer: ArrowWriter<W>,
}

impl<W: Write + Send> ParquetWriter<W> {
    /// Begins a table. `carried` names the carried columns of the input table.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn new(kind: TableKind, carried: &[String], to: W) -> io::Result<Self> {
        let fields = kind.columns(carried).into_iter().map(|column| {
            let holds = match column.kind {
                CellKind::Text => DataType::Utf8,
                CellKind::Number => DataType::Float64,
                CellKind::Count => DataType::UInt64,
            };
            let field = Field::new(column.head, holds, true);
            match column.unit {
                "" => field,
                unit => field.with_metadata([("unit", unit)]),
            }
        });
        let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
        let properties = WriterProperties::builder()
            .set_created_by(format!("tapjoint batch {}", env!("CARGO_PKG_VERSION")))
            .set_compression(Compression::SNAPPY)
            .set_max_row_group_row_count(Some(GROUP_ROWS))
            .build();
        Ok(Self {
            kind,
            writer: ArrowWriter::try_new(to, schema.clone(), Some(properties))
                .map_err(system_error)?,
            schema,
            count: 0,
            rows: Vec::new(),
        })
    }

    /// Writes the rows of the next record.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, record: &BatchRecord) -> io::Result<()> {
        self.count += 1;
        self.rows.extend(self.kind.rows(self.count, record));
        match self.rows.len() < ROWS_AT_ONCE {
            true => Ok(()),
            false => self.write_rows(),
        }
    }

    fn write_rows(&mut self) -> io::Result<()> {
        let fields = self.schema.fields().iter().enumerate();
        let columns = fields.map(|(index, field)| {
            let cells = self.rows.iter().map(|row| &row[index]);
            column_of(field.data_type(), cells)
        });
        let columns: Vec<ArrayRef> = columns.collect();
        let batch = RecordBatch::try_new(self.schema.clone(), columns).map_err(io::Error::other)?;
        self.writer.write(&batch).map_err(system_error)?;
        self.rows.clear();
        Ok(())
    }

    /// Writes what is still held back, and the footer.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        self.write_rows()?;
        self.writer.into_inner().map_err(system_error)?.flush()
    }
}

/// Returns the error of the system that is the cause, such as a full disk.
fn system_error(cause: ParquetError) -> io::Error {
    match cause {
        ParquetError::External(cause) => match cause.downcast::<io::Error>() {
            Ok(cause) => *cause,
            Err(cause) => io::Error::other(cause),
        },
        cause => io::Error::other(cause),
    }
}

/// Returns cells of one kind as a column.
fn column_of<'a>(holds: &DataType, cells: impl Iterator<Item = &'a Cell>) -> ArrayRef {
    match holds {
        DataType::Float64 => Arc::new(Float64Array::from_iter(cells.map(|cell| match cell {
            Cell::Number(value) => *value,
            Cell::Text(_) | Cell::Count(_) => None,
        }))),
        DataType::UInt64 => Arc::new(UInt64Array::from_iter(cells.map(|cell| match cell {
            Cell::Count(count) => *count,
            Cell::Text(_) | Cell::Number(_) => None,
        }))),
        _ => Arc::new(StringArray::from_iter(cells.map(|cell| match cell {
            Cell::Text(text) => text.as_deref(),
            Cell::Number(_) | Cell::Count(_) => None,
        }))),
    }
}

/// Longest text of an input table (bytes): compressed, it may be a small file.
const LONGEST_TEXT: usize = 1 << 30;

/// Returns a Parquet table as comma separated values, heads first.
///
/// # Errors
/// A sentence: the bytes are no Parquet table, a column holds lists or records, or the text is too long.
pub fn csv_of(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let broken = |cause: ParquetError| format!("cannot be read as Parquet: {cause}");
    let reader = SerializedFileReader::new(Bytes::copy_from_slice(bytes)).map_err(broken)?;
    let mut table = csv::Writer::from_writer(Vec::new());
    let mut length = 0;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let heads: Vec<&str> = schema
        .root_schema()
        .get_fields()
        .iter()
        .map(|field| field.name())
        .collect();
    let mut add = |cells: Vec<String>| {
        length += cells.iter().map(|cell| cell.len() + 1).sum::<usize>();
        if length > LONGEST_TEXT {
            return Err("holds more than 1 GB of text; give a smaller table".to_owned());
        }
        // A vector takes all that is written.
        table.write_record(cells).map_err(|cause| cause.to_string())
    };
    add(heads.iter().map(|head| (*head).to_owned()).collect())?;
    for row in reader.get_row_iter(None).map_err(broken)? {
        let row = row.map_err(broken)?;
        let cells = row.get_column_iter().map(|(head, value)| match value {
            Value::Null => Ok(String::new()),
            Value::Str(text) => Ok(text.clone()),
            Value::Float(number) => Ok(number.to_string()),
            Value::Double(number) => Ok(number.to_string()),
            Value::Group(_) | Value::ListInternal(_) | Value::MapInternal(_) | Value::Bytes(_) => {
                Err(format!(
                    "the column `{head}` holds no plain values; leave it out, or save it as text"
                ))
            }
            other => Ok(other.to_string()),
        });
        add(cells.collect::<Result<_, _>>()?)?;
    }
    table.into_inner().map_err(|cause| cause.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{ModeRow, TestRow};
    use crate::tables::TABLES;
    use arrow_array::Array;
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

    fn record(frequency: Option<f64>, carried: &str) -> BatchRecord {
        BatchRecord {
            test: TestRow {
                file: "a, \"b\".wav".to_owned(),
                carried: vec![carried.to_owned()],
                ..TestRow::default()
            },
            modes: vec![ModeRow {
                mode: Some(1),
                frequency,
                ..ModeRow::default()
            }],
            ..BatchRecord::default()
        }
    }

    fn written(kind: TableKind, records: &[BatchRecord]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut table = ParquetWriter::new(kind, &["serial".to_owned()], &mut bytes).unwrap();
        for record in records {
            table.add(number, record).unwrap();
        }
        table.finish().unwrap();
        bytes
    }

    #[test]
    fn val_numbers_and_units_come_back() {
        let values = [Some(0.1 + 0.2), None, Some(5e-324)];
        let records: Vec<BatchRecord> = values.iter().map(|value| record(*value, "=7")).collect();
        let bytes = Bytes::from(written(TableKind::Modes, &records));
        let reader = ParquetRecordBatchReaderBuilder::try_new(bytes).unwrap();
        let field = reader
            .schema()
            .field_with_name("frequency_Hz")
            .unwrap()
            .clone();
        assert_eq!(field.metadata()["unit"], "Hz");
        let batch = reader.build().unwrap().next().unwrap().unwrap();
        let column = batch.column_by_name("frequency_Hz").unwrap();
        let column = column.as_any().downcast_ref::<Float64Array>().unwrap();
        let found: Vec<Option<f64>> = column.iter().collect();
        assert_eq!(found, values);
    }

    /// The rows are more than a row group holds, and no multiple of the rows at once.
    #[test]
    fn limit_rows_of_several_groups_are_all_there() {
        let count = GROUP_ROWS + ROWS_AT_ONCE / 2;
        let records = vec![record(Some(1.0), ""); count];
        let reader = SerializedFileReader::new(Bytes::from(written(TableKind::Tests, &records)));
        let metadata = reader.unwrap().metadata().clone();
        assert_eq!(metadata.file_metadata().num_rows(), count as i64);
        assert_eq!(metadata.num_row_groups(), 2);
    }

    #[test]
    fn limit_tables_without_rows_have_their_columns() {
        for kind in TABLES {
            let reader = SerializedFileReader::new(Bytes::from(written(kind, &[]))).unwrap();
            let schema = reader.metadata().file_metadata().schema_descr_ptr();
            assert_eq!(
                schema.num_columns(),
                kind.columns(&["serial".to_owned()]).len()
            );
        }
    }

    #[test]
    fn recover_an_input_table_from_its_parquet() {
        let bytes = written(TableKind::Tests, &[record(None, "=7"), record(None, "")]);
        let text = String::from_utf8(csv_of(&bytes).unwrap()).unwrap();
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let heads = reader.headers().unwrap().clone();
        let place = |head: &str| heads.iter().position(|own| own == head).unwrap();
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert_eq!(&rows[0][place("test")], "a, \"b\".wav");
        assert_eq!(&rows[0][place("serial")], "=7");
        assert_eq!(&rows[1][place("modes")], "0");
        assert_eq!(&rows[1][place("kt_N_per_m")], "");
    }

    /// A file that is cut anywhere, or changed in one byte, gives an error or another table, and no panic.
    #[test]
    fn limit_a_broken_parquet_file_is_an_error() {
        let bytes = written(TableKind::Hypotheses, &[record(None, "")]);
        for cut in 0..bytes.len() {
            assert!(csv_of(&bytes[..cut]).is_err(), "{cut}");
        }
        for place in 0..bytes.len() {
            let mut other = bytes.clone();
            other[place] ^= 0x55;
            let _ = csv_of(&other);
        }
    }
}
