// Rigid bodies: suture points, proxies, tool, needle, force arrow. One mesh drawn at many places.

struct Body {
    // Rows of scene_from_body.
    @location(2) row_x: vec4f,
    @location(3) row_y: vec4f,
    @location(4) row_z: vec4f,
    // Colour; w: strength of the reflection.
    @location(5) colour: vec4f,
    // Sharpness of the reflection, share of own light, -, -.
    @location(6) finish: vec4f,
}

struct Seen {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) colour: vec4f,
    @location(3) finish: vec4f,
}

fn place(p: vec3f, body: Body) -> vec3f {
    let q = vec4f(p, 1.0);
    return vec3f(dot(body.row_x, q), dot(body.row_y, q), dot(body.row_z, q));
}

@vertex
fn vertex(@location(0) position: vec3f, @location(1) normal: vec3f, body: Body) -> Seen {
    let p = place(position, body);
    // Columns at right angles: the inverse transpose divides by their squared lengths.
    let x = vec3f(body.row_x.x, body.row_y.x, body.row_z.x);
    let y = vec3f(body.row_x.y, body.row_y.y, body.row_z.y);
    let z = vec3f(body.row_x.z, body.row_y.z, body.row_z.z);
    let n = normal.x * x / dot(x, x) + normal.y * y / dot(y, y) + normal.z * z / dot(z, z);
    return Seen(globals.clip_from_scene * vec4f(p, 1.0), p, normalize(n), body.colour, body.finish);
}

@vertex
fn shadow(@location(0) position: vec3f, @location(1) normal: vec3f, body: Body) -> @builtin(position) vec4f {
    return globals.light_from_scene * vec4f(place(position, body), 1.0);
}

@fragment
fn fragment(seen: Seen) -> @location(0) vec4f {
    let n = normalize(seen.normal);
    let m = Material(seen.colour.rgb, vec3f(0.15), seen.colour.w, seen.finish.x, 1.0);
    var colour = lit(m, seen.position, n);
    if seen.colour.w > 0.9 {
        // Steel mirrors a dark room with a bright ceiling.
        let to_eye = normalize(globals.eye.xyz - seen.position);
        let mirrored = reflect(-to_eye, select(-n, n, dot(n, to_eye) >= 0.0));
        let bands = 0.5 + 0.5 * sin(mirrored.x * 5.0 + mirrored.y * 3.0);
        let ceiling = smoothstep(0.05, 0.85, mirrored.z) * (0.25 + 0.75 * bands);
        colour = colour * 0.5 + seen.colour.rgb * (0.07 + 1.1 * ceiling);
    }
    return shown(mix(colour, seen.colour.rgb * 1.15, seen.finish.y));
}
