// SPDX-License-Identifier: GPL-3.0-or-later
// What an engine does: binds a mesh from its vertex buffers, deforms it by its own threads into a buffer of OpenGL ES
// that has normals, too, and draws that without a window.
//
//   engine PICTURE.ppm
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>
#include <vector>

#include "sinew/sinew.h"

namespace {

constexpr int kSize = 256, kSides = 32, kRings = 33;

/// What the engine keeps of a vertex, as files of models have it.
struct SkinnedVertex {
    std::array<std::uint8_t, 4> joints;
    std::array<std::uint8_t, 4> weights;
};

/// What it draws.
struct DrawnVertex {
    sinew::Vec3<float> position;
    sinew::Vec3<float> normal;
};

struct Model {
    std::vector<sinew::Vec3<float>> positions, normals;
    std::vector<SkinnedVertex> skin;
    std::vector<std::uint16_t> indices;
};

/// A tube along Y whose upper half follows joint 1.
Model tube() {
    Model model;
    for (int ring = 0; ring < kRings; ++ring) {
        const float y = 2.0f * static_cast<float>(ring) / (kRings - 1) - 1.0f;
        const float upper = std::clamp(0.5f + 1.5f * y, 0.0f, 1.0f);
        const auto weight = static_cast<std::uint8_t>(std::lround(255.0f * upper));
        for (int side = 0; side < kSides; ++side) {
            const float angle = 6.2831853f * static_cast<float>(side) / kSides;
            const sinew::Vec3<float> normal(std::cos(angle), 0.0f, std::sin(angle));
            model.positions.push_back(0.3f * normal + sinew::Vec3<float>(0.0f, y, 0.0f));
            model.normals.push_back(normal);
            model.skin.push_back({{0, 1, 0, 0}, {static_cast<std::uint8_t>(255 - weight), weight, 0, 0}});
            if (ring + 1 == kRings) continue;
            const int a = ring * kSides + side, b = ring * kSides + (side + 1) % kSides;
            for (const int corner : {a, a + kSides, b, b, a + kSides, b + kSides})
                model.indices.push_back(static_cast<std::uint16_t>(corner));
        }
    }
    return model;
}

/// The engine's job system: here a thread for each job.
void run_jobs(void*, std::size_t jobs, void (*job)(void* of_job, std::size_t i), void* of_job) {
    std::vector<std::thread> threads;
    for (std::size_t i = 1; i < jobs; ++i) threads.emplace_back(job, of_job, i);
    job(of_job, 0);
    for (std::thread& thread : threads) thread.join();
}

void expect(bool is_true, const char* what) {
    if (is_true) return;
    std::fprintf(stderr, "engine: %s\n", what);
    std::exit(1);
}

void open_gl() {
    const auto get =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
    expect(get != nullptr, "no EGL without a window here");
    EGLDisplay display = get(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    expect(eglInitialize(display, nullptr, nullptr) == EGL_TRUE, "EGL does not start");
    const std::array<EGLint, 5> wanted{EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                       EGL_OPENGL_ES3_BIT, EGL_NONE};
    EGLConfig config;
    EGLint count = 0;
    eglBindAPI(EGL_OPENGL_ES_API);
    expect(eglChooseConfig(display, wanted.data(), &config, 1, &count) == EGL_TRUE && count == 1,
           "no OpenGL ES 3");
    const std::array<EGLint, 3> version{EGL_CONTEXT_CLIENT_VERSION, 3, EGL_NONE};
    EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version.data());
    expect(eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE, "no OpenGL ES 3");
}

GLuint shader(GLenum kind, const char* text) {
    const GLuint made = glCreateShader(kind);
    glShaderSource(made, 1, &text, nullptr);
    glCompileShader(made);
    GLint compiled = 0;
    glGetShaderiv(made, GL_COMPILE_STATUS, &compiled);
    expect(compiled == GL_TRUE, "a shader does not compile");
    return made;
}

void use_program() {
    const GLuint program = glCreateProgram();
    glAttachShader(program, shader(GL_VERTEX_SHADER, R"(#version 300 es
        layout(location = 0) in vec3 position;
        layout(location = 1) in vec3 normal;
        out vec3 n;
        void main() {
            n = normal;
            gl_Position = vec4(0.6 * position.xy, 0.3 * position.z, 1.0);
        })"));
    glAttachShader(program, shader(GL_FRAGMENT_SHADER, R"(#version 300 es
        precision mediump float;
        in vec3 n;
        out vec4 colour;
        void main() { colour = vec4(vec3(0.55 - 0.4 * normalize(n).z + 0.05 * n.x), 1.0); })"));
    glLinkProgram(program);
    glUseProgram(program);
}

/// Buffers of the model; returns that of the vertices, which each frame fills.
GLuint make_buffers(const Model& model) {
    std::array<GLuint, 3> made{};
    GLuint vertex_array = 0;
    glGenVertexArrays(1, &vertex_array);
    glBindVertexArray(vertex_array);
    glGenBuffers(2, made.data());
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, made[1]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(2 * model.indices.size()),
                 model.indices.data(), GL_STATIC_DRAW);
    glBindBuffer(GL_ARRAY_BUFFER, made[0]);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(sizeof(DrawnVertex) * model.positions.size()),
                 nullptr, GL_STREAM_DRAW);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex), nullptr);
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(DrawnVertex),
                          reinterpret_cast<const void*>(offsetof(DrawnVertex, normal)));
    glEnableVertexAttribArray(0);
    glEnableVertexAttribArray(1);
    return made[0];
}

void make_target() {
    std::array<GLuint, 2> made{};
    GLuint target = 0;
    glGenFramebuffers(1, &target);
    glBindFramebuffer(GL_FRAMEBUFFER, target);
    glGenRenderbuffers(2, made.data());
    glBindRenderbuffer(GL_RENDERBUFFER, made[0]);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, kSize, kSize);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, made[0]);
    glBindRenderbuffer(GL_RENDERBUFFER, made[1]);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT16, kSize, kSize);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, made[1]);
    expect(glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE, "nothing to draw to");
    glViewport(0, 0, kSize, kSize);
    glEnable(GL_DEPTH_TEST);
}

/// Writes what was drawn; returns how many pixels that is.
int write_picture(const char* path) {
    std::vector<std::uint8_t> pixels(4 * kSize * kSize);
    glReadPixels(0, 0, kSize, kSize, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    std::ofstream file(path, std::ios::binary);
    file << "P6 " << kSize << ' ' << kSize << " 255\n";
    int drawn = 0;
    for (int y = kSize - 1; y >= 0; --y) {
        for (int x = 0; x < kSize; ++x) {
            const auto* const pixel =
                reinterpret_cast<const char*>(&pixels[static_cast<std::size_t>(4 * (y * kSize + x))]);
            file.write(pixel, 3);
            drawn += pixel[0] != 0;
        }
    }
    return drawn;
}

}  // namespace

int main(int count, char** words) {
    expect(count == 2, "name a picture to write: engine PICTURE.ppm");
    sinew::use_job_system({&run_jobs, nullptr, 2});

    const Model model = tube();
    const std::size_t vertices = model.positions.size();
    const sinew::InfluenceBuffer<std::uint8_t, std::uint8_t, 4> skin{
        {&model.skin.front().joints, vertices, sizeof(SkinnedVertex)},
        {&model.skin.front().weights, vertices, sizeof(SkinnedVertex)}};
    const sinew::BufferInfluences influences = sinew::influences_of(skin);
    const sinew::Binding binding({model.positions, influences.offsets, influences.bones, influences.weights});
    const sinew::SkinnedNormals character(binding, sinew::Dq::info, {model.normals});

    open_gl();
    use_program();
    make_target();
    const GLuint buffer = make_buffers(model);
    std::vector<sinew::Affine<float>> pose(2);
    for (int frame = 0; frame <= 24; ++frame) {
        const float angle = 1.5f * static_cast<float>(frame) / 24.0f;
        pose[1] = sinew::to_affine(
            sinew::from_axis_angle<sinew::QuatVec>(sinew::Vec3<float>(0.0f, 0.0f, 1.0f), angle));
        glBindBuffer(GL_ARRAY_BUFFER, buffer);
        auto* const drawn = static_cast<DrawnVertex*>(
            glMapBufferRange(GL_ARRAY_BUFFER, 0, static_cast<GLsizeiptr>(sizeof(DrawnVertex) * vertices),
                             GL_MAP_WRITE_BIT | GL_MAP_READ_BIT));
        const bool fits =
            character.deform(pose, {.threads = 2}, {&drawn->position, vertices, sizeof(DrawnVertex)},
                             {&drawn->normal, vertices, sizeof(DrawnVertex)});
        expect(fits, "sizes differ");
        glUnmapBuffer(GL_ARRAY_BUFFER);
        glClearColor(0.0f, 0.0f, 0.0f, 1.0f);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(model.indices.size()), GL_UNSIGNED_SHORT, nullptr);
    }
    const int drawn = write_picture(words[1]);
    std::printf("%s: %zu vertices, 25 frames, %d pixels in the last\n", words[1], vertices, drawn);
    return drawn > 0 ? 0 : 1;
}
