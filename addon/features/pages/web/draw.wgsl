// SPDX-License-Identifier: MIT

struct Uniforms {
    @align(16) world_from_armature: mat4x4f,
    @align(16) clip_from_world: mat4x4f,
    @align(16) eye: vec3f,
    @align(16) key_light: vec3f,  // where two lights are that go with the camera
    @align(16) fill_light: vec3f,
    @align(16) range: vec2f,  // the values at both ends of the ramp
}
@group(0) @binding(0) var<uniform> uniforms: Uniforms;
@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> surface: array<vec4f>;
@group(0) @binding(3) var<storage, read> ramp: array<vec4f>;

struct Corner {
    @builtin(position) place: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) value: f32,
}

@vertex
fn place(@builtin(vertex_index) vertex: u32) -> Corner {
    let world = uniforms.world_from_armature * vec4f(points[vertex].xyz, 1.0);
    let clip = uniforms.clip_from_world * world;
    // Depth is from 0 to 1 here.
    return Corner(vec4f(clip.xy, 0.5 * (clip.z + clip.w), clip.w), world.xyz, surface[vertex].xyz, surface[vertex].w);
}

@fragment
fn shade(corner: Corner) -> @location(0) vec4f {
    var n = normalize(corner.normal);
    n = select(n, -n, dot(n, uniforms.eye - corner.position) < 0.0);
    // The last is light from above.
    var light = 0.26 + 0.62 * max(dot(n, uniforms.key_light), 0.0) + 0.16 * max(dot(n, uniforms.fill_light), 0.0)
        + 0.1 * n.z;
    var base = vec3f(0.80, 0.765, 0.72);
    let last = f32(arrayLength(&ramp) - 1u);
    if HAS_HEAT == 1u {
        let is_logarithmic = IS_LOGARITHMIC == 1u;
        let low = select(uniforms.range.x, log(uniforms.range.x), is_logarithmic);
        let high = select(uniforms.range.y, log(uniforms.range.y), is_logarithmic);
        let value = select(corner.value, log(max(corner.value, 1e-12)), is_logarithmic);
        let stop = last * clamp((value - low) / (high - low), 0.0, 1.0);
        base = mix(ramp[u32(stop)], ramp[u32(ceil(stop))], fract(stop)).rgb;
        light = 0.5 + 0.5 * light;
    }
    return vec4f(base * min(light, 1.15), 1.0);
}
