#version 300 es
// SPDX-License-Identifier: MIT
precision highp float;

uniform vec3 eye;
uniform vec3 key_light;  // where two lights are that go with the camera
uniform vec3 fill_light;
uniform sampler2D ramp;
uniform vec2 range;  // the values at both ends of the ramp

in vec3 position;
in vec3 normal;
in float value;
out vec4 colour;

void main() {
    vec3 n = normalize(normal);
    n = dot(n, eye - position) < 0.0 ? -n : n;
    // The last is light from above.
    float light = 0.26 + 0.62 * max(dot(n, key_light), 0.0) + 0.16 * max(dot(n, fill_light), 0.0) + 0.1 * n.z;
    vec3 base = vec3(0.80, 0.765, 0.72);
    if (HAS_HEAT == 1) {
        bool is_logarithmic = IS_LOGARITHMIC == 1;
        vec2 ends = is_logarithmic ? log(range) : range;
        float at = is_logarithmic ? log(max(value, 1e-12)) : value;
        int last = textureSize(ramp, 0).x - 1;
        float stop = float(last) * clamp((at - ends.x) / (ends.y - ends.x), 0.0, 1.0);
        vec3 next = texelFetch(ramp, ivec2(ceil(stop), 0), 0).rgb;
        base = mix(texelFetch(ramp, ivec2(stop, 0), 0).rgb, next, fract(stop));
        light = 0.5 + 0.5 * light;
    }
    colour = vec4(base * min(light, 1.15), 1.0);
}
