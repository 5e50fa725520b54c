// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/stages/delta_mush/delta_mush.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>

#include "sinew/base/fork_safe.h"
#include "sinew/base/thread_pool.h"
#include "sinew/mesh/check_arrays.h"
#include "sinew/stages/delta_mush/mush_mesh.h"

namespace sinew {
namespace {

// Below this, waking a second thread at each iteration costs more than it saves.
constexpr std::size_t kMushVerticesWorthAThread = 16384;

// This many iterations run over the mesh closely one behind the other, so that what they read is still in the
// cache.
constexpr std::size_t kIterationsTogether = 8;

// With a radius, the share of vertices whose edges may be too short for the number of iterations.
constexpr double kShareOfShortest = 0.1;

void check(std::span<const Vec3<float>> rest_points, const DeltaMushSettings& settings,
           std::size_t vertices) {
    check_points(rest_points, vertices);
    const auto most = static_cast<std::size_t>(DeltaMushDefinition::kMaxIterations);
    if (settings.iterations > most) {
        fail("iterations", "at most " + std::to_string(most), std::to_string(settings.iterations));
    }
    if (!(settings.radius >= 0.0f) || !std::isfinite(settings.radius)) {
        fail("radius", "0 or more", std::to_string(settings.radius));
    }
    if (!(settings.factor >= 0.0f && settings.factor <= 1.0f)) {
        fail("factor", "a number from 0 to 1", std::to_string(settings.factor));
    }
    if (!settings.weights.empty()) check_weights("weights", settings.weights, vertices);
}

Float4 float4_of(const Vec3<float>& point) { return {{point.x, point.y, point.z, 0.0f}}; }

/// How often a mesh is smoothed, and the factor of each vertex in the order of the mesh, not yet divided by its
/// number of neighbours.
struct Amount {
    std::size_t iterations;
    std::vector<float> factors;
};

/// The mean squared length of each vertex's edges at rest, in the order of the mesh; 0 without edges.
std::vector<double> squared_lengths(const MushMesh& mesh, std::span<const Vec3<float>> rest_points) {
    std::vector<double> squared(mesh.vertices.size());
    const auto point = [&](std::size_t i) { return Vec3<double>(rest_points[mesh.vertices[i]]); };
    for (const MushRun& run : mesh.runs) {
        const std::int32_t* neighbours = mesh.neighbours.data() + run.first_neighbour;
        for (std::size_t i = run.begin; i < run.end && run.valence > 0; ++i) {
            for (std::size_t k = 0; k < run.valence; ++k) {
                const std::size_t neighbour =
                    run.is_consecutive
                        ? static_cast<std::size_t>(neighbours[k]) + (i - run.begin)
                        : static_cast<std::size_t>(neighbours[(i - run.begin) * run.valence + k]);
                const Vec3<double> edge = point(neighbour) - point(i);
                squared[i] += glm::dot(edge, edge);
            }
            squared[i] /= run.valence;
        }
    }
    return squared;
}

Amount amount_of(const MushMesh& mesh, std::span<const Vec3<float>> rest_points,
                 const DeltaMushSettings& settings) {
    Amount amount{settings.iterations, std::vector<float>(mesh.vertices.size(), settings.factor)};
    if (settings.radius == 0.0f) return amount;
    const std::vector<double> squared = squared_lengths(mesh, rest_points);
    std::vector<double> sorted;
    std::ranges::copy_if(squared, std::back_inserter(sorted), [](double square) { return square > 0.0; });
    if (sorted.empty() || settings.factor == 0.0f) return {0, std::move(amount.factors)};
    const auto shortest =
        sorted.begin() + static_cast<std::ptrdiff_t>(kShareOfShortest * static_cast<double>(sorted.size()));
    std::ranges::nth_element(sorted, shortest);
    const auto radius = static_cast<double>(settings.radius);
    // What the factors of all iterations must sum to, times the squared length of edges.
    const double wanted = (settings.type == SmoothType::length_weighted ? 4.0 : 2.0) * radius * radius;
    const double iterations = std::ceil(wanted / (static_cast<double>(settings.factor) * *shortest));
    amount.iterations =
        static_cast<std::size_t>(std::clamp(iterations, 1.0, DeltaMushDefinition::kMaxIterations));
    for (std::size_t i = 0; i < squared.size(); ++i) {
        const double factor = wanted / (static_cast<double>(amount.iterations) * squared[i]);
        amount.factors[i] = static_cast<float>(std::min(factor, static_cast<double>(settings.factor)));
    }
    return amount;
}

}  // namespace

struct DeltaMush::State {
    State(const MeshTopology& topology, std::size_t vertices)
        : mesh(make_mush_mesh(topology, vertices)),
          kept(vertices + kLanes),
          smoothed{std::vector<Float4>(vertices + kLanes), std::vector<Float4>(vertices + kLanes)} {}

    void bind(std::span<const Vec3<float>> points, const DeltaMushSettings& settings);

    /// What bind() sets.
    struct Bound {
        SmoothType type;
        std::size_t iterations;
        std::vector<float> factors;        // as in MushFrame, with room for one more vector
        bool is_uniform;                   // as in MushFrame
        std::vector<MushDetails> details;  // indexed by MushBlock::first_detail
    };

    /// Smooths smoothed[0]. Returns the index of the result in `smoothed`.
    std::size_t smooth(const Bound& settings, std::size_t threads) const noexcept;

    [[nodiscard]] std::size_t threads_for(std::size_t threads) const noexcept {
        return useful_threads(threads, mesh.vertices.size(), kMushVerticesWorthAThread);
    }

    MushMesh mesh;
    // One pointer: a child that is forked during bind() has all or nothing of it.
    std::unique_ptr<Bound> bound;

    // Scratch for one call at a time. Elements beyond the vertices stay 0.
    mutable ForkSafeMutex mutex;
    std::vector<Float4> kept;
    mutable std::vector<Float4> smoothed[2];
};

void DeltaMush::State::bind(std::span<const Vec3<float>> points, const DeltaMushSettings& settings) {
    check(points, settings, mesh.vertices.size());
    Amount amount = amount_of(mesh, points, settings);
    amount.factors.resize(mesh.vertices.size() + kLanes);
    auto made = std::make_unique<Bound>(
        Bound{settings.type, amount.iterations, std::move(amount.factors),
              settings.weights.empty() && !settings.pin_boundary && settings.radius == 0.0f,
              std::vector<MushDetails>(mesh.detail_count)});
    const float by_type = settings.type == SmoothType::length_weighted ? 2.0f : 1.0f;
    for (const MushRun& run : mesh.runs) {
        for (std::size_t i = run.begin; i < run.end && run.valence > 0; ++i) {
            const float weight =
                settings.weights.empty() ? 1.0f : std::clamp(settings.weights[mesh.vertices[i]], 0.0f, 1.0f);
            const bool is_pinned = settings.pin_boundary && mesh.on_boundary[i] != 0;
            made->factors[i] *= is_pinned ? 0.0f : by_type * weight / static_cast<float>(run.valence);
        }
    }

    const std::scoped_lock lock(mutex);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        kept[i] = smoothed[0][i] = float4_of(points[mesh.vertices[i]]);
    }
    // Uses the kernels that smooth each frame, so that the rest pose is reproduced.
    const std::size_t result = smooth(*made, threads_for(0));
    const MushFrame frame{
        .mesh = &mesh, .from = smoothed[result].data(), .details = made->details.data(), .rest = kept.data()};
    kMushKernel.take_details[target_in_use()](frame, 0, mesh.chunk_count());
    bound = std::move(made);
}

/// Runs several iterations over the mesh together. An iteration on a chunk reads what the previous iteration
/// wrote to chunks at most mesh.reach away, and then overwrites what the iteration before that wrote to the same
/// chunk.
class Iterations {
public:
    Iterations(const MushMesh& mesh, std::size_t threads) noexcept
        : chunks_(mesh.chunk_count()),
          reach_(mesh.reach),
          parts_(std::min(threads, chunks_)),
          most_(std::min(kIterationsTogether,
                         1 + (parts_ > 1 ? chunks_ / parts_ / (2 * reach_) : kIterationsTogether))) {}

    /// The largest number of iterations that can run together.
    [[nodiscard]] std::size_t most() const noexcept { return most_; }

    /// Calls run(iteration, chunk) for every chunk and each of `count` iterations.
    template <class Run>
    void run(std::size_t count, const Run& run) const {
        const auto parts = [&](std::size_t begin, std::size_t end) {
            for (std::size_t part = begin; part < end; ++part) run_part(part, count, run);
        };
        parallel_for(parts_, parts_, parts, 1);
        if (parts_ < 2 || count < 2) return;
        const auto between = [&](std::size_t begin, std::size_t end) {
            for (std::size_t part = begin; part < end; ++part) run_between(part, count, run);
        };
        parallel_for(parts_ - 1, parts_, between, 1);
    }

private:
    [[nodiscard]] std::size_t begin(std::size_t part) const noexcept { return chunks_ * part / parts_; }

    /// Runs the part's trapezoid: iteration i skips i * reach chunks at each inner border.
    template <class Run>
    void run_part(std::size_t part, std::size_t count, const Run& run) const {
        const std::size_t first = begin(part);
        const std::size_t last = begin(part + 1);
        for (std::size_t front = first; front < last + reach_ * (count - 1); ++front) {
            for (std::size_t i = 0; i < count && front >= first + reach_ * i; ++i) {
                const std::size_t chunk = front - reach_ * i;
                const bool is_before = part > 0 && chunk < first + reach_ * i;
                const bool is_behind = chunk + (part + 1 < parts_ ? reach_ * i : 0) >= last;
                if (!is_before && !is_behind) run(i, chunk);
            }
        }
    }

    /// Runs the chunks that run_part() skipped at the border between a part and the next.
    template <class Run>
    void run_between(std::size_t part, std::size_t count, const Run& run) const {
        const std::size_t middle = begin(part + 1);
        for (std::size_t i = 1; i < count; ++i) {
            for (std::size_t chunk = middle - reach_ * i; chunk < middle + reach_ * i; ++chunk) run(i, chunk);
        }
    }

    std::size_t chunks_;
    std::size_t reach_;
    std::size_t parts_;
    std::size_t most_;
};

std::size_t DeltaMush::State::smooth(const Bound& settings, std::size_t threads) const noexcept {
    if (mesh.vertices.empty()) return 0;
    const bool by_length = settings.type == SmoothType::length_weighted;
    const auto smooth_chunk =
        (by_length ? kMushKernel.smooth_by_length : kMushKernel.smooth)[target_in_use()];
    const Iterations together(mesh, threads);
    for (std::size_t first = 0; first < settings.iterations; first += together.most()) {
        together.run(std::min(together.most(), settings.iterations - first),
                     [&](std::size_t i, std::size_t chunk) {
                         const std::size_t from = (first + i) % 2;
                         const MushFrame frame{.mesh = &mesh,
                                               .from = smoothed[from].data(),
                                               .to = smoothed[1 - from].data(),
                                               .factors = settings.factors.data(),
                                               .is_uniform = settings.is_uniform};
                         smooth_chunk(frame, chunk, chunk + 1);
                     });
    }
    return settings.iterations % 2;
}

DeltaMush::DeltaMush(const MeshTopology& topology, std::span<const Vec3<float>> rest_points,
                     const DeltaMushSettings& settings)
    : state_(make_owned<State>(topology, rest_points.size())) {
    state_->bind(rest_points, settings);
}

void DeltaMush::bind(std::span<const Vec3<float>> rest_points, const DeltaMushSettings& settings) {
    state_->bind(rest_points, settings);
}

std::size_t DeltaMush::vertex_count() const noexcept { return state_->mesh.vertices.size(); }
std::size_t DeltaMush::iterations() const noexcept {
    const std::scoped_lock lock(state_->mutex);
    return state_->bound->iterations;
}

Status DeltaMush::apply(std::span<Vec3<float>> points, float scale, std::size_t threads) const noexcept {
    const State& state = *state_;
    const MushMesh& mesh = state.mesh;
    if (points.size() != mesh.vertices.size()) return Status::size;
    if (!std::isfinite(scale)) return Status::not_finite;
    const std::scoped_lock lock(state.mutex);
    threads = state.threads_for(threads);
    // Read once, because the compiler assumes that any stored number may change it.
    const auto gather = [&, from = points.data()](std::size_t begin, std::size_t end) {
        const std::uint32_t* const vertices = mesh.vertices.data();
        Float4* const to = state.smoothed[0].data();
        end = std::min(end * MushMesh::kChunk, mesh.vertices.size());
        for (std::size_t i = begin * MushMesh::kChunk; i < end; ++i) {
            // The fourth number is always 0.
            std::memcpy(&to[i], &from[vertices[i]], sizeof(Vec3<float>));
        }
    };
    parallel_for(mesh.chunk_count(), threads, gather, 1);
    const MushFrame frame{.mesh = &mesh,
                          .from = state.smoothed[state.smooth(*state.bound, threads)].data(),
                          .details = state.bound->details.data(),
                          .scale = scale,
                          .points = points.data()};
    const auto finish = [&](std::size_t begin, std::size_t end) {
        kMushKernel.finish[target_in_use()](frame, begin, end);
    };
    parallel_for(mesh.chunk_count(), threads, finish, 1);
    return Status::ok;
}

}  // namespace sinew
