//! The structures of Parquet that precede its values: the footer and the page headers.
//!
//! They list the types of their fields, from
//! <https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift>. A field
//! that is not listed may have any type and is skipped. Names are the format's.

use super::thrift::Kind::{Binary, Bool, Byte, Double, List, Struct, Whole};
use super::thrift::{Kind, Layout};

/// A union's member without fields.
const EMPTY: Kind = Struct(&[]);

const TIME_UNIT: &Layout = &[(1, EMPTY), (2, EMPTY), (3, EMPTY)];

/// `TimeType` and `TimestampType`.
const TIME: Kind = Struct(&[(1, Bool), (2, Struct(TIME_UNIT))]);

const LOGICAL_TYPE: &Layout = &[
    (1, EMPTY),
    (2, EMPTY),
    (3, EMPTY),
    (4, EMPTY),
    // Decimal
    (5, Struct(&[(1, Whole), (2, Whole)])),
    (6, EMPTY),
    (7, TIME),
    (8, TIME),
    // Integer
    (10, Struct(&[(1, Byte), (2, Bool)])),
    (11, EMPTY),
    (12, EMPTY),
    (13, EMPTY),
    (14, EMPTY),
    (15, EMPTY),
    // Variant, geometry, geography
    (16, Struct(&[(1, Byte)])),
    (17, Struct(&[(1, Binary)])),
    (18, Struct(&[(1, Binary), (2, Whole)])),
    (19, EMPTY),
];

const SCHEMA_ELEMENT: &Layout = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Binary),
    (5, Whole),
    (6, Whole),
    (7, Whole),
    (8, Whole),
    (9, Whole),
    (10, Struct(LOGICAL_TYPE)),
];

const STATISTICS: &Layout = &[
    (1, Binary),
    (2, Binary),
    (3, Whole),
    (4, Whole),
    (5, Binary),
    (6, Binary),
    (7, Bool),
    (8, Bool),
    (9, Whole),
];

const SIZE_STATISTICS: &Layout = &[(1, Whole), (2, List(&Whole)), (3, List(&Whole))];

const BOUNDING_BOX: &Layout = &[
    (1, Double),
    (2, Double),
    (3, Double),
    (4, Double),
    (5, Double),
    (6, Double),
    (7, Double),
    (8, Double),
];

const GEOSPATIAL_STATISTICS: &Layout = &[(1, Struct(BOUNDING_BOX)), (2, List(&Whole))];

const KEY_VALUE: &Layout = &[(1, Binary), (2, Binary)];

const PAGE_ENCODING_STATS: &Layout = &[(1, Whole), (2, Whole), (3, Whole)];

const COLUMN_META_DATA: &Layout = &[
    (1, Whole),
    (2, List(&Whole)),
    (3, List(&Binary)),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Whole),
    (8, List(&Struct(KEY_VALUE))),
    (9, Whole),
    (10, Whole),
    (11, Whole),
    (12, Struct(STATISTICS)),
    (13, List(&Struct(PAGE_ENCODING_STATS))),
    (14, Whole),
    (15, Whole),
    (16, Struct(SIZE_STATISTICS)),
    (17, Struct(GEOSPATIAL_STATISTICS)),
];

const COLUMN_CHUNK: &Layout = &[
    (1, Binary),
    (2, Whole),
    (3, Struct(COLUMN_META_DATA)),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Whole),
];

const SORTING_COLUMN: &Layout = &[(1, Whole), (2, Bool), (3, Bool)];

const ROW_GROUP: &Layout = &[
    (1, List(&Struct(COLUMN_CHUNK))),
    (2, Whole),
    (3, Whole),
    (4, List(&Struct(SORTING_COLUMN))),
    (5, Whole),
    (6, Whole),
    (7, Whole),
];

const COLUMN_ORDER: &Layout = &[(1, EMPTY), (2, EMPTY), (3, EMPTY)];

/// The footer.
pub const FILE_META_DATA: &Layout = &[
    (1, Whole),
    (2, List(&Struct(SCHEMA_ELEMENT))),
    (3, Whole),
    (4, List(&Struct(ROW_GROUP))),
    (5, List(&Struct(KEY_VALUE))),
    (6, Binary),
    (7, List(&Struct(COLUMN_ORDER))),
];

const DATA_PAGE_HEADER: &Layout = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Whole),
    (5, Struct(STATISTICS)),
];

const DICTIONARY_PAGE_HEADER: &Layout = &[(1, Whole), (2, Whole), (3, Bool)];

const DATA_PAGE_HEADER_V2: &Layout = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Bool),
    (8, Struct(STATISTICS)),
];

/// A page header.
pub const PAGE_HEADER: &Layout = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Whole),
    (5, Struct(DATA_PAGE_HEADER)),
    (6, EMPTY),
    (7, Struct(DICTIONARY_PAGE_HEADER)),
    (8, Struct(DATA_PAGE_HEADER_V2)),
];
