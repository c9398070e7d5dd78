//! JSON schemas of the topics. They describe what is written; nothing is validated with them here.

use super::{HAND, SERVO_STATE, TISSUE, TISSUE_OUTLINE, WOUND_REPORT};
use serde_json::{Map, Value, json};

/// One topic of a trace.
pub(super) struct Topic {
    pub(super) name: &'static str,
    pub(super) schema_name: &'static str,
    pub(super) schema: Value,
}

/// All topics, in the order in which they are declared in the file.
pub(super) fn topics() -> [Topic; 5] {
    [
        Topic { name: SERVO_STATE, schema_name: "suture.ServoState", schema: servo_state() },
        Topic { name: WOUND_REPORT, schema_name: "suture.WoundReport", schema: wound_report() },
        Topic { name: TISSUE, schema_name: "foxglove.PointCloud", schema: point_cloud() },
        Topic { name: TISSUE_OUTLINE, schema_name: "suture.SceneOutline", schema: outline() },
        Topic { name: HAND, schema_name: "foxglove.PoseInFrame", schema: pose_in_frame() },
    ]
}

fn number() -> Value {
    json!({"type": "number"})
}

fn integer() -> Value {
    json!({"type": "integer", "minimum": 0})
}

fn list(items: &Value) -> Value {
    json!({"type": "array", "items": items})
}

fn object<'n>(fields: impl IntoIterator<Item = (&'n str, Value)>) -> Value {
    let properties: Map<String, Value> = fields.into_iter().map(|(name, kind)| (name.to_owned(), kind)).collect();
    json!({"type": "object", "properties": properties})
}

fn all_of<'n>(kind: &'n Value, names: &'n [&'n str]) -> impl Iterator<Item = (&'n str, Value)> + 'n {
    names.iter().map(|name| (*name, kind.clone()))
}

fn timestamp() -> Value {
    json!({
        "type": "object", "title": "time",
        "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999}}
    })
}

fn stamped<'n>(fields: impl IntoIterator<Item = (&'n str, Value)>) -> Value {
    object([("timestamp", timestamp()), ("sequence", integer())].into_iter().chain(fields))
}

fn servo_state() -> Value {
    let vector = list(&number());
    let device = object(
        all_of(&vector, &["position_m", "velocity_m_per_s", "orientation", "force_n", "unclipped_force_n"])
            .chain(all_of(&integer(), &["buttons", "present"]))
            .chain(all_of(&list(&integer()), &["press_count", "release_count"])),
    );
    let handle = object(
        all_of(&vector, &["position_m", "velocity_m_per_s", "applied_force_n"])
            .chain([("line_tension_n", number())])
            .chain(all_of(&integer(), &["mode", "pair"])),
    );
    let counters = [
        "port_epoch",
        "mode",
        "fault",
        "flags",
        "period_ns",
        "ticks",
        "missed",
        "port_sequence",
        "port_age_ns",
        "port_rung",
        "handle_count",
        "hand_sender",
        "hand_turn",
    ];
    stamped(all_of(&integer(), &counters).chain([
        ("energy_to_hand_j", number()),
        ("devices", list(&device)),
        ("handles", list(&handle)),
    ]))
}

fn wound_report() -> Value {
    let vector = list(&number());
    let points = ["left_original_m", "left_current_m", "right_original_m", "right_current_m"];
    let scalars = [
        "open_distance_m",
        "original_distance_m",
        "current_distance_m",
        "relative_error",
        "holding_force_n",
        "stitch_tension_n",
        "rest_length_m",
        "slipped_m",
    ];
    let row = object(
        all_of(&vector, &points)
            .chain(all_of(&number(), &scalars))
            .chain(all_of(&integer(), &["pair", "scene_kind", "flags", "scene_index"])),
    );
    let text = json!({"type": "string"});
    let answer =
        object(all_of(&integer(), &["sequence", "sender", "command", "result"]).chain([("reason", text.clone())]));
    let counters = [
        "control",
        "scene_index",
        "scene_count",
        "scene_kind",
        "stage",
        "integrator",
        "substeps",
        "command_sequence",
        "command_result",
        "points_taken",
        "grips_used",
        "scene_generation",
        "pair",
        "pair_count",
        "solver_steps",
        "step_time_ns",
        "step_time_max_ns",
    ];
    stamped(
        all_of(&integer(), &counters)
            .chain(all_of(&number(), &["sim_time_s", "stability_number", "er_max"]))
            .chain(all_of(&number(), &["gap_m", "closed_gap_m", "distance_floor_m"]))
            .chain([("integrator_reason", text), ("answers", list(&answer))])
            .chain([("rows", list(&row)), ("line_m", list(&vector))]),
    )
}

fn outline() -> Value {
    stamped(
        all_of(&integer(), &["scene_generation", "scene_kind", "node_count"])
            .chain(all_of(&list(&integer()), &["triangles", "layers", "pairs", "edges"])),
    )
}

fn pose() -> Value {
    object([
        ("position", object(all_of(&number(), &["x", "y", "z"]))),
        ("orientation", object(all_of(&number(), &["x", "y", "z", "w"]))),
    ])
}

fn pose_in_frame() -> Value {
    object([
        ("timestamp", timestamp()),
        ("frame_id", json!({"type": "string"})),
        ("pose", pose()),
        ("buttons", integer()),
    ])
}

fn point_cloud() -> Value {
    let field = object([("name", json!({"type": "string"})), ("offset", integer()), ("type", integer())]);
    stamped([
        ("frame_id", json!({"type": "string"})),
        ("pose", pose()),
        ("point_stride", integer()),
        ("fields", list(&field)),
        ("data", json!({"type": "string", "contentEncoding": "base64"})),
        ("scene_generation", integer()),
        ("sim_time_s", number()),
    ])
}
