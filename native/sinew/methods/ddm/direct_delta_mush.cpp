// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/methods/ddm/direct_delta_mush.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <map>
#include <string>

#include "sinew/methods/ddm/block_factor.h"
#include "sinew/methods/packed_binding.h"

namespace sinew {
namespace {

// Number of smoothing steps. After four, the neighbourhood's weights are close to a Gaussian.
constexpr int kSteps = 4;

// The share of the work before the first bone.
constexpr double kShareOfFactor = 0.1;

// Smaller weights are set to 0: far below any weight that is kept, and far above denormals, which are slow.
constexpr double kNothing = 1e-13;

// The smallest weight of exact results.
constexpr double kLeastExact = 1e-10;

// A neighbourhood whose sum of squared extents is below this share of the mesh's is a point: its computed extents
// are rounding errors, from which no rotation can be found.
constexpr double kLeastExtentOfMesh = 1e-12;

// The rows of one block then fit into the first-level cache together with the right sides that they change.
constexpr std::size_t kMaxColumns = 32;

// Share of zeros that a block may store: up to this share they cost less than one more block.
constexpr double kMaxZeros = 0.3;

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int32_t>;

// 1, x, y, z, xx, yy, zz, yz, xz, xy: the columns that are smoothed for each bone.
constexpr std::size_t kColumns = kGroupColumns;
using Columns = std::array<double, kColumns>;

/// Half the cotangent of the angle at `corner`; 0 for a triangle without area.
double half_cotangent(const Vec3<double>& corner, const Vec3<double>& a, const Vec3<double>& b) {
    const Vec3<double> to_a = a - corner;
    const Vec3<double> to_b = b - corner;
    const double twice_area = glm::length(glm::cross(to_a, to_b));
    const double longest = std::max(glm::dot(to_a, to_a), glm::dot(to_b, to_b));
    return twice_area > 1e-9 * longest ? 0.5 * glm::dot(to_a, to_b) / twice_area : 0.0;
}

/// The matrix of one step, and the mass of each vertex; both divided by the mean mass.
struct Smoothing {
    SparseMatrix step;
    std::vector<double> mass;
};

Smoothing smoothing_of(std::span<const Vec3<float>> points, std::span<const std::int32_t> triangles,
                       double radius) {
    const std::size_t count = points.size();
    Smoothing smoothing{SparseMatrix(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count)),
                        std::vector<double>(count)};
    // Entries below the diagonal: one for each of an edge's triangles, to be summed.
    using Entry = Eigen::Triplet<double, std::int32_t>;
    std::vector<Entry> entries;
    entries.reserve(triangles.size());
    double area = 0.0;
    for (std::size_t i = 0; i < triangles.size(); i += 3) {
        const auto corners = triangles.subspan(i, 3);
        const auto point = [&](std::size_t k) {
            return Vec3<double>(points[static_cast<std::size_t>(corners[k % 3])]);
        };
        const double third = glm::length(glm::cross(point(1) - point(0), point(2) - point(0))) / 6.0;
        for (std::size_t k = 0; k < 3; ++k) {
            smoothing.mass[static_cast<std::size_t>(corners[k])] += third;
            area += third;
            const std::int32_t a = corners[(k + 1) % 3];
            const std::int32_t b = corners[(k + 2) % 3];
            if (a != b) {
                entries.emplace_back(std::max(a, b), std::min(a, b),
                                     half_cotangent(point(k), point(k + 1), point(k + 2)));
            }
        }
    }
    const double mean = area > 0.0 ? area / static_cast<double>(count) : 1.0;
    for (double& mass : smoothing.mass) mass = mass > 0.0 ? mass / mean : 1.0;
    SparseMatrix edges(smoothing.step.rows(), smoothing.step.cols());
    edges.setFromTriplets(entries.begin(), entries.end());
    entries.clear();
    std::vector<double> diagonal = smoothing.mass;
    const double time = radius * radius / (2.0 * kSteps) / mean;
    for (std::int32_t column = 0; column < edges.outerSize(); ++column) {
        for (SparseMatrix::InnerIterator edge(edges, column); edge; ++edge) {
            const double weight = time * std::max(0.0, edge.value());
            if (weight == 0.0) continue;
            entries.emplace_back(edge.row(), column, -weight);
            diagonal[static_cast<std::size_t>(edge.row())] += weight;
            diagonal[static_cast<std::size_t>(column)] += weight;
        }
    }
    for (std::size_t i = 0; i < count; ++i) {
        entries.emplace_back(static_cast<std::int32_t>(i), static_cast<std::int32_t>(i), diagonal[i]);
    }
    smoothing.step.setFromTriplets(entries.begin(), entries.end());
    return smoothing;
}

/// Makes the blocks of a factor.
class BlockMaker {
public:
    /// lower  L below its diagonal, by columns, with ascending rows in each
    BlockMaker(const SparseMatrix& lower, const Eigen::VectorXd& diagonal) : lower_(lower) {
        factor_.diagonal.assign(diagonal.begin(), diagonal.end());
    }

    BlockFactor run() {
        const std::size_t columns = factor_.diagonal.size();
        for (std::size_t column = 0; column < columns; ++column) {
            if (column > begin_ && !add(column)) {
                close(column);
                begin_ = column;
            }
            if (column == begin_) {
                const auto rows = rows_of(column);
                below_.assign(rows.begin(), rows.end());
                numbers_ = rows.size();
            }
        }
        if (columns > 0) close(columns);
        return std::move(factor_);
    }

private:
    [[nodiscard]] std::span<const std::int32_t> rows_of(std::size_t column) const {
        const std::int32_t* const starts = lower_.outerIndexPtr() + column;
        return {lower_.innerIndexPtr() + starts[0], lower_.innerIndexPtr() + starts[1]};
    }

    /// Adds `column` to the block of columns from begin_ on, if that stores few enough zeros. Returns whether it
    /// did.
    bool add(std::size_t column) {
        const std::size_t width = column + 1 - begin_;
        if (width > kMaxColumns) return false;
        if (below_.empty() || below_.front() != static_cast<std::int32_t>(column)) return false;
        const auto rows = rows_of(column);
        merged_.clear();
        std::set_union(below_.begin() + 1, below_.end(), rows.begin(), rows.end(),
                       std::back_inserter(merged_));
        const std::size_t all = width * merged_.size() + BlockFactor::triangle(width);
        const std::size_t numbers = numbers_ + rows.size();
        if (static_cast<double>(all - numbers) > kMaxZeros * static_cast<double>(all)) return false;
        below_.swap(merged_);
        numbers_ = numbers;
        return true;
    }

    /// Writes the block of columns [begin_, end).
    void close(std::size_t end) {
        const std::size_t width = end - begin_;
        const std::size_t first_value = factor_.values.size();
        factor_.blocks.push_back({static_cast<std::uint32_t>(begin_), static_cast<std::uint32_t>(width),
                                  static_cast<std::uint32_t>(factor_.rows.size()),
                                  static_cast<std::uint32_t>(below_.size()), first_value});
        factor_.rows.insert(factor_.rows.end(), below_.begin(), below_.end());
        const std::size_t below = first_value + BlockFactor::triangle(width);
        factor_.values.resize(below + width * below_.size());
        for (std::size_t k = 0; k < width; ++k) {
            SparseMatrix::InnerIterator i(lower_, static_cast<Eigen::Index>(begin_ + k));
            for (; i && static_cast<std::size_t>(i.row()) < end; ++i) {
                const std::size_t row = static_cast<std::size_t>(i.row()) - begin_;
                factor_.values[first_value + BlockFactor::triangle(row) + k] = i.value();
            }
            for (std::size_t row = 0; i; ++i, ++row) {
                while (below_[row] != i.row()) ++row;
                factor_.values[below + width * row + k] = i.value();
            }
        }
    }

    const SparseMatrix& lower_;
    BlockFactor factor_;
    // The block of columns from begin_ on.
    std::size_t begin_ = 0;
    std::vector<std::int32_t> below_;
    std::size_t numbers_ = 0;
    std::vector<std::int32_t> merged_;
};

/// Solves a step for kGroups bones at once, and only for rows where they are not 0.
class Solver {
public:
    explicit Solver(const SparseMatrix& matrix) {
        const Eigen::SimplicialLDLT<SparseMatrix, Eigen::Lower, Eigen::AMDOrdering<std::int32_t>> factor(
            matrix);
        if (factor.info() != Eigen::Success) {
            fail("rest_points", "a mesh whose areas are numbers", "one that is too large or too small");
        }
        const auto count = static_cast<std::size_t>(matrix.rows());
        factor_ = BlockMaker(factor.matrixL().nestedExpression(), factor.vectorD()).run();
        for (std::size_t i = 0; i < count; ++i) {
            row_numbers_.push_back(
                static_cast<std::size_t>(factor.permutationP().indices()(static_cast<Eigen::Index>(i))));
        }
    }

    /// The solver's number of row `i`.
    [[nodiscard]] std::size_t row(std::size_t i) const { return row_numbers_[i]; }

    /// Arguments as for SolveBlocks.
    void solve(std::span<Columns> x, std::span<std::uint8_t> is_nonzero) const {
        kSolveBlocks[target_in_use()](factor_, kNothing, x.front().data(), is_nonzero.data());
    }

private:
    BlockFactor factor_;
    std::vector<std::size_t> row_numbers_;
};

/// The moments of a bone at a vertex, with the vertex as the origin.
struct Found {
    std::uint32_t vertex;
    std::array<float, kColumns> moments;
};

Columns columns_of(const Vec3<double>& p, double weight) {
    Columns columns{1.0, p.x, p.y, p.z, p.x * p.x, p.y * p.y, p.z * p.z, p.y * p.z, p.x * p.z, p.x * p.y};
    for (double& number : columns) number *= weight;
    return columns;
}

/// The axes whose product is in each column after the first four.
constexpr std::array<std::array<int, 2>, 6> kSecond{{{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};

/// The moments relative to `o`.
std::array<float, kColumns> moved_to(const Vec3<double>& o, const Columns& m) {
    const double weight = m[0];
    const Vec3<double> first = Vec3<double>(m[1], m[2], m[3]) - weight * o;
    std::array<float, kColumns> moved{static_cast<float>(weight), static_cast<float>(first.x),
                                      static_cast<float>(first.y), static_cast<float>(first.z)};
    // Moments of (p - o) (p - o)^T: those of p p^T minus first o^T, minus o first^T, minus weight o o^T.
    for (std::size_t i = 0; const auto [a, b] : kSecond) {
        const double number = m[4 + i] - first[a] * o[b] - o[a] * first[b] - weight * o[a] * o[b];
        moved[4 + i++] = static_cast<float>(number);
    }
    return moved;
}

/// An influence of a bone.
struct Weight {
    std::uint32_t vertex;
    float weight;
};
using WeightsByBone = std::map<std::int32_t, std::vector<Weight>>;

WeightsByBone weights_by_bone(const NormalisedInfluences& influences) {
    WeightsByBone found;
    for (std::size_t vertex = 0; vertex + 1 < influences.offsets.size(); ++vertex) {
        for (std::uint32_t i = influences.offsets[vertex]; i < influences.offsets[vertex + 1]; ++i) {
            const Influence<float>& influence = influences.influences[i];
            found[influence.bone].push_back({static_cast<std::uint32_t>(vertex), influence.weight});
        }
    }
    return found;
}

/// Computes the moments of kGroups bones at all vertices where they are not 0.
class BoneSmoother {
public:
    BoneSmoother(const Solver& solver, std::span<const double> mass, std::span<const Vec3<double>> points)
        : solver_(solver),
          points_(points),
          mass_(points.size()),
          x_(kGroups * points.size()),
          is_nonzero_(points.size()) {
        for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
            mass_[solver.row(vertex)] = mass[vertex];
        }
    }

    /// Stops early if `goes_on()` returns false.
    ///
    /// weights  [at most kGroups] the influences of each bone
    template <class GoesOn>
    void find(std::span<const std::vector<Weight>* const> weights, double least, const GoesOn& goes_on,
              std::span<std::vector<Found>> found) {
        clear();
        for (std::size_t bone = 0; bone < weights.size(); ++bone) {
            for (const auto& [vertex, weight] : *weights[bone]) {
                const std::size_t row = solver_.row(vertex);
                Columns& x = x_[kGroups * row + bone];
                const Columns columns = columns_of(points_[vertex], static_cast<double>(weight));
                for (std::size_t c = 0; c < kColumns; ++c) x[c] += columns[c];
                is_nonzero_[row] = 1;
            }
        }
        for (int step = 0; step < kSteps; ++step) {
            if (!goes_on()) return;
            for (std::size_t row = 0; row < points_.size(); ++row) {
                if (is_nonzero_[row] == 0) continue;
                for (std::size_t bone = 0; bone < kGroups; ++bone) {
                    for (double& number : x_[kGroups * row + bone]) number *= mass_[row];
                }
            }
            solver_.solve(x_, is_nonzero_);
        }
        for (std::size_t vertex = 0; vertex < points_.size(); ++vertex) {
            const std::size_t row = solver_.row(vertex);
            if (is_nonzero_[row] == 0) continue;
            const Columns* const x = &x_[kGroups * row];
            for (std::size_t bone = 0; bone < weights.size(); ++bone) {
                if (x[bone][0] < least) continue;
                found[bone].push_back(
                    {static_cast<std::uint32_t>(vertex), moved_to(points_[vertex], x[bone])});
            }
        }
    }

private:
    void clear() {
        for (std::size_t row = 0; row < points_.size(); ++row) {
            if (is_nonzero_[row] == 0) continue;
            std::fill_n(&x_[kGroups * row], kGroups, Columns{});
            is_nonzero_[row] = 0;
        }
    }

    const Solver& solver_;
    std::span<const Vec3<double>> points_;
    // In the solver's order.
    std::vector<double> mass_;
    std::vector<Columns> x_;  // [points][kGroups], 0 between calls
    std::vector<std::uint8_t> is_nonzero_;
};

/// Writes the rows of one vertex from the moments of its bones.
///
/// least_extent  threshold for the sum of squared extents; below it a neighbourhood is a point, with second
///               moments of 0
void add_rows(std::uint32_t vertex, const Vec3<double>& point,
              std::span<const std::pair<std::int32_t, const Found*>> of_bones, double least_extent,
              std::vector<float>& rows) {
    double total = 0.0;
    Vec3<double> centre(0.0);  // relative to the vertex
    const auto at = [](const Found& found, std::size_t i) { return static_cast<double>(found.moments[i]); };
    for (const auto& [bone, found] : of_bones) {
        total += at(*found, 0);
        centre += Vec3<double>(at(*found, 1), at(*found, 2), at(*found, 3));
    }
    centre /= total;
    double extent = -glm::dot(centre, centre);
    for (const auto& [bone, found] : of_bones) {
        extent += (at(*found, 4) + at(*found, 5) + at(*found, 6)) / total;
    }
    const bool is_point = extent < least_extent;
    for (const auto& [bone, found] : of_bones) {
        const double weight = at(*found, 0) / total;
        const Vec3<double> first = Vec3<double>(at(*found, 1), at(*found, 2), at(*found, 3)) / total;
        const Vec3<float> from_origin(first + weight * point);
        rows.insert(rows.end(), {static_cast<float>(vertex), static_cast<float>(bone),
                                 static_cast<float>(weight), from_origin.x, from_origin.y, from_origin.z});
        for (std::size_t i = 0; const auto [a, b] : kSecond) {
            const double moment = at(*found, 4 + i++) / total - first[a] * centre[b] - centre[a] * first[b] +
                                  weight * centre[a] * centre[b];
            rows.push_back(is_point ? 0.0f : static_cast<float>(moment));
        }
    }
}

std::vector<float> find_moments(const BindData& data, std::span<const std::int32_t> triangles, double radius,
                                bool exact, Job& job) {
    const std::size_t vertex_count = data.rest_points.size();
    const NormalisedInfluences influences = normalised_influences(data);
    const WeightsByBone by_bone = weights_by_bone(influences);
    const Smoothing smoothing = smoothing_of(data.rest_points, triangles, radius);
    const Solver solver(smoothing.step);
    if (!job.report_progress(kShareOfFactor)) return {};

    // Relative to the mesh's middle, so that a mesh far from the origin loses no digits.
    std::vector<Vec3<double>> points(data.rest_points.begin(), data.rest_points.end());
    Vec3<double> origin(0.0);
    for (const Vec3<double>& point : points) origin += point / static_cast<double>(vertex_count);
    double size = 0.0;
    for (Vec3<double>& point : points) {
        point -= origin;
        size = std::max(size, glm::dot(point, point));
    }
    std::vector<std::int32_t> bones;
    std::vector<const std::vector<Weight>*> weights;
    for (const auto& [bone, own] : by_bone) {
        bones.push_back(bone);
        weights.push_back(&own);
    }
    std::vector<std::vector<Found>> found(bones.size());
    const std::size_t groups = (bones.size() + kGroups - 1) / kGroups;
    std::atomic<std::size_t> done{0};
    const double least = exact ? kLeastExact : kLeastMoment;
    const auto go_on = [&] {
        const auto share =
            static_cast<double>(done.load(std::memory_order_relaxed)) / static_cast<double>(kSteps * groups);
        return job.report_progress(kShareOfFactor + (1.0 - kShareOfFactor) * share);
    };
    job.for_each(groups, 1, [&](std::size_t begin, std::size_t end) {
        BoneSmoother smoother(solver, smoothing.mass, points);
        for (std::size_t group = begin; group < end; ++group) {
            const std::size_t first = kGroups * group;
            const std::size_t count = std::min(kGroups, bones.size() - first);
            smoother.find(
                std::span(weights).subspan(first, count), least,
                [&] {
                    const bool goes_on = go_on();
                    done.fetch_add(1, std::memory_order_relaxed);
                    return goes_on;
                },
                std::span(found).subspan(first, count));
        }
    });
    if (!go_on()) return {};

    std::size_t row_count = 0;
    for (const std::vector<Found>& of_bone : found) row_count += of_bone.size();
    std::vector<float> rows;
    rows.reserve(kMomentFloats * row_count);
    std::vector<std::size_t> next(bones.size());
    std::vector<std::pair<std::int32_t, const Found*>> of_vertex;
    for (std::uint32_t vertex = 0; vertex < vertex_count; ++vertex) {
        of_vertex.clear();
        for (std::size_t bone = 0; bone < bones.size(); ++bone) {
            if (next[bone] == found[bone].size() || found[bone][next[bone]].vertex != vertex) continue;
            of_vertex.emplace_back(bones[bone], &found[bone][next[bone]++]);
        }
        if (influences.offsets[vertex] == influences.offsets[vertex + 1]) continue;
        if (of_vertex.empty()) continue;
        add_rows(vertex, Vec3<double>(data.rest_points[vertex]), of_vertex, kLeastExtentOfMesh * size, rows);
    }
    return rows;
}

}  // namespace

std::vector<float> direct_delta_mush(const BindData& data, std::span<const std::int32_t> triangles,
                                     double radius, Job& job, bool exact) {
    check(data);
    const std::size_t vertex_count = data.rest_points.size();
    check_triangles(triangles, vertex_count);
    if (!(radius >= 0.0) || !std::isfinite(radius)) {
        fail("radius", "a number of 0 or more", std::to_string(radius));
    }
    if (vertex_count > kMaxMomentVertices) {
        fail("rest_points", "at most " + std::to_string(kMaxMomentVertices) + " points",
             std::to_string(vertex_count));
    }
    return find_moments(data, triangles, radius, exact, job);
}

}  // namespace sinew
