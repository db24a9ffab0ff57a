//! Tables of a batch as Parquet, and input tables that are Parquet.
//!
//! The columns are those of the comma separated tables. Their units stand in the schema's metadata, under `units`: a JSON
//! object of heads and units. pyarrow shows it as `schema.metadata[b"units"]`.

use crate::record::BatchRecord;
use crate::tables::{Cell, CellKind, Column, TableKind};
use bytes::Bytes;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::record::Field as Value;
use parquet::schema::types::Type;
use std::io::{self, Write};
use std::sync::Arc;

/// Rows of a row group. A group is held in memory until it is full: 30 MB of the widest table.
const GROUP_ROWS: usize = 8192;

/// Writes one table as Parquet, record by record.
#[derive(Debug)]
pub struct ParquetWriter<W: Write + Send> {
    kind: TableKind,
    columns: Vec<Column>,
    /// Records so far.
    count: u64,
    rows: Vec<Vec<Cell>>,
    writer: SerializedFileWriter<W>,
}

impl<W: Write + Send> ParquetWriter<W> {
    /// Begins a table. `carried` names the carried columns of the input table.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn new(kind: TableKind, carried: &[String], to: W) -> io::Result<Self> {
        let columns = kind.columns(carried);
        let mut units = serde_json::Map::new();
        for column in columns.iter().filter(|column| !column.unit.is_empty()) {
            units.insert(column.head.clone(), column.unit.into());
        }
        let units = KeyValue::new("units".to_owned(), serde_json::to_string(&units)?);
        let properties = WriterProperties::builder()
            .set_created_by(format!("tapjoint batch {}", env!("CARGO_PKG_VERSION")))
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(vec![units]))
            .build();
        let fields = columns.iter().map(field_of).collect::<Result<_, _>>();
        let schema = fields.and_then(|fields| {
            let schema = Type::group_type_builder("tapjoint");
            schema.with_fields(fields).build()
        });
        let schema = Arc::new(schema.map_err(system_error)?);
        let writer = SerializedFileWriter::new(to, schema, Arc::new(properties));
        Ok(Self {
            kind,
            columns,
            count: 0,
            rows: Vec::new(),
            writer: writer.map_err(system_error)?,
        })
    }

    /// Writes the rows of the next record.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, record: &BatchRecord) -> io::Result<()> {
        self.count += 1;
        self.rows.extend(self.kind.rows(self.count, record));
        match self.rows.len() < GROUP_ROWS {
            true => Ok(()),
            false => self.write_group().map_err(system_error),
        }
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for (place, column) in self.columns.iter().enumerate() {
            let Some(mut writer) = group.next_column()? else {
                break;
            };
            let cells = self.rows.iter().map(|row| &row[place]);
            match column.kind {
                CellKind::Text => write_column::<ByteArrayType>(&mut writer, cells, |cell| {
                    let Cell::Text(Some(text)) = cell else {
                        return None;
                    };
                    Some(ByteArray::from(text.as_str()))
                }),
                CellKind::Number => write_column::<DoubleType>(&mut writer, cells, |cell| {
                    let Cell::Number(value) = cell else {
                        return None;
                    };
                    *value
                }),
                // Parquet keeps whole numbers from 0 in the bits of those with a sign.
                CellKind::Count => write_column::<Int64Type>(&mut writer, cells, |cell| {
                    let Cell::Count(Some(count)) = cell else {
                        return None;
                    };
                    Some(count.cast_signed())
                }),
            }?;
            writer.close()?;
        }
        group.close()?;
        self.rows.clear();
        Ok(())
    }

    /// Writes what is still held back, and the footer.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        if !self.rows.is_empty() {
            self.write_group().map_err(system_error)?;
        }
        self.writer.into_inner().map_err(system_error)?.flush()
    }
}

/// Returns the description of a column, whose cells may be empty.
fn field_of(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match column.kind {
        CellKind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        CellKind::Number => (Physical::DOUBLE, None),
        CellKind::Count => (Physical::INT64, Some(LogicalType::integer(64, false))),
    };
    Type::primitive_type_builder(&column.head, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()
        .map(Arc::new)
}

/// Writes the cells of a column. Of an empty one only its level is written, 0.
fn write_column<'a, T: DataType>(
    writer: &mut SerializedColumnWriter,
    cells: impl Iterator<Item = &'a Cell>,
    value: impl Fn(&Cell) -> Option<T::T>,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for found in cells.map(value) {
        levels.push(i16::from(found.is_some()));
        values.extend(found);
    }
    let writer = writer.typed::<T>();
    writer.write_batch(&values, Some(&levels), None).map(drop)
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
    use parquet::record::RowAccessor;

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
            table.add(record).unwrap();
        }
        table.finish().unwrap();
        bytes
    }

    #[test]
    fn val_numbers_and_units_come_back() {
        let values = [Some(0.1 + 0.2), None, Some(5e-324)];
        let records: Vec<BatchRecord> = values.iter().map(|value| record(*value, "=7")).collect();
        let bytes = Bytes::from(written(TableKind::Modes, &records));
        let reader = SerializedFileReader::new(bytes).unwrap();
        let metadata = reader.metadata().file_metadata().key_value_metadata();
        let units = metadata.unwrap()[0].value.clone().unwrap();
        let units: serde_json::Value = serde_json::from_str(&units).unwrap();
        assert_eq!(units["frequency_Hz"], "Hz");
        assert_eq!(units["damping"], "1");
        assert!(units.get("label").is_none());
        let place = TableKind::Modes.columns(&[]);
        let place = place
            .iter()
            .position(|column| column.head == "frequency_Hz");
        let rows = reader.get_row_iter(None).unwrap().map(Result::unwrap);
        let found: Vec<Option<f64>> = rows
            .map(|row| row.get_double(place.unwrap()).ok())
            .collect();
        assert_eq!(found, values);
    }

    /// The rows are more than a row group holds.
    #[test]
    fn limit_rows_of_several_groups_are_all_there() {
        let count = GROUP_ROWS + GROUP_ROWS / 2;
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
