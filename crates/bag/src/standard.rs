//! Definitions of the standard message types that this crate reads or writes (fields of ROS 2 Jazzy), and of drivers'
//! types whose every version is known, for bags that carry none.

/// Beginning of `lbr_fri_idl/LBRState`.
macro_rules! lbr_status {
    () => {
        "float64 sample_time\nint8 session_state\nint8 connection_quality\nint8 safety_state\n\
         int8 operation_mode\nint8 drive_state\nint8 client_command_mode\nint8 overlay_type\n\
         int8 control_mode\nuint32 time_stamp_sec\nuint32 time_stamp_nano_sec\n"
    };
}

/// Its end.
macro_rules! lbr_torques {
    () => {
        "float64[7] measured_torque\nfloat64[7] commanded_torque\nfloat64[7] external_torque\n\
         float64[7] ipo_joint_position\nfloat64 tracking_performance\n"
    };
}

/// Fields of each type, by its short name. A type of which there are versions has an entry each.
const DEFINITIONS: &[(&str, &str)] = &[
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"),
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("std_msgs/String", "string data\n"),
    (
        "std_msgs/ColorRGBA",
        "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n",
    ),
    (
        "std_msgs/MultiArrayDimension",
        "string label\nuint32 size\nuint32 stride\n",
    ),
    (
        "std_msgs/MultiArrayLayout",
        "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n",
    ),
    (
        "std_msgs/Float64MultiArray",
        "std_msgs/MultiArrayLayout layout\nfloat64[] data\n",
    ),
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    ),
    (
        "control_msgs/DynamicJointState",
        "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n",
    ),
    (
        "control_msgs/InterfaceValue",
        "string[] interface_names\nfloat64[] values\n",
    ),
    // With FRI 1.
    (
        "lbr_fri_idl/LBRState",
        concat!(
            lbr_status!(),
            "float64[7] measured_joint_position\nfloat64[7] commanded_joint_position\n",
            lbr_torques!()
        ),
    ),
    // With FRI 2.
    (
        "lbr_fri_idl/LBRState",
        concat!(
            lbr_status!(),
            "float64[7] measured_joint_position\n",
            lbr_torques!()
        ),
    ),
    (
        "sensor_msgs/PointField",
        "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n\
         uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
    ),
    (
        "sensor_msgs/PointCloud2",
        "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n\
         bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    ),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "geometry_msgs/Quaternion",
        "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
    ),
    (
        "geometry_msgs/Pose",
        "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    ),
    (
        "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
    ),
    (
        "geometry_msgs/PoseWithCovarianceStamped",
        "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n",
    ),
    (
        "geometry_msgs/PointStamped",
        "std_msgs/Header header\ngeometry_msgs/Point point\n",
    ),
    (
        "geometry_msgs/Wrench",
        "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    ),
    (
        "geometry_msgs/WrenchStamped",
        "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
    ),
    (
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    ),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    (
        "sensor_msgs/CompressedImage",
        "std_msgs/Header header\nstring format\nuint8[] data\n",
    ),
    ("visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"),
    (
        "visualization_msgs/MeshFile",
        "string filename\nuint8[] data\n",
    ),
    (
        "visualization_msgs/Marker",
        "int32 ARROW=0\nint32 CUBE=1\nint32 SPHERE=2\nint32 CYLINDER=3\nint32 LINE_STRIP=4\nint32 LINE_LIST=5\n\
         int32 CUBE_LIST=6\nint32 SPHERE_LIST=7\nint32 POINTS=8\nint32 TEXT_VIEW_FACING=9\nint32 MESH_RESOURCE=10\n\
         int32 TRIANGLE_LIST=11\nint32 ARROW_STRIP=12\nint32 ADD=0\nint32 MODIFY=0\nint32 DELETE=2\n\
         int32 DELETEALL=3\n\
         std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n\
         geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\n\
         bool frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n\
         sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n\
         string mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n",
    ),
    (
        "visualization_msgs/MarkerArray",
        "visualization_msgs/Marker[] markers\n",
    ),
    (
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
    ),
];

/// The definitions of a type by its short name, `pkg/Type`, one a version, without those of the types nested in it.
pub(crate) fn standard_definitions(short_name: &str) -> impl Iterator<Item = &'static str> {
    let of_type = move |(name, _): &&(&str, &str)| *name == short_name;
    DEFINITIONS.iter().filter(of_type).map(|(_, text)| *text)
}

/// The first of them.
pub(crate) fn standard_definition(short_name: &str) -> Option<&'static str> {
    standard_definitions(short_name).next()
}
