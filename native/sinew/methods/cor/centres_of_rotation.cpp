// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/methods/cor/centres_of_rotation.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <type_traits>
#include <unordered_map>

#include "sinew/methods/packed_binding.h"

namespace sinew {
namespace {

constexpr double kSigma = 0.1;
// Edges along which weights change by this much are halved.
constexpr double kSplit = 0.1;
constexpr double kCellsOfOne = 64.0;

// Cells are summed in strips of this size, with a sum for each position, which compilers vectorise.
constexpr std::size_t kStrip = 8;

constexpr std::size_t kTrianglesBetweenReports = 4096;
constexpr std::size_t kVerticesOfAChunk = 64;

/// Merges the influences of a vertex, so that each bone occurs once.
void merge(std::span<const Influence<float>> influences, std::vector<Influence<double>>& merged) {
    merged.clear();
    for (const Influence<float>& influence : influences) {
        const auto same = std::ranges::find(merged, influence.bone, &Influence<double>::bone);
        const auto weight = static_cast<double>(influence.weight);
        if (same != merged.end()) {
            same->weight += weight;
        } else {
            merged.push_back({influence.bone, weight});
        }
    }
}

/// Numbers pairs of bones from 0 on, in the order in which they are added.
class PairNumbers {
public:
    std::uint32_t find_or_add(std::int32_t a, std::int32_t b) {
        return numbers_.try_emplace(key(a, b), static_cast<std::uint32_t>(numbers_.size())).first->second;
    }
    /// Null if no triangle has both bones.
    [[nodiscard]] const std::uint32_t* find(std::int32_t a, std::int32_t b) const {
        const auto found = numbers_.find(key(a, b));
        return found == numbers_.end() ? nullptr : &found->second;
    }
    [[nodiscard]] std::size_t count() const { return numbers_.size(); }

private:
    static std::uint64_t key(std::int32_t a, std::int32_t b) {
        return static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b);
    }
    std::unordered_map<std::uint64_t, std::uint32_t> numbers_;
};

/// Triangles that are treated as one for a pair of bones. All sums are weighted by area times the pair's weights.
struct Cell {
    std::uint32_t pair = 0;
    double mass = 0.0;
    Vec3<double> centroids{0.0};
    double first = 0.0;  // sums of the weights of the pair's bones
    double second = 0.0;
};

/// Splits triangles and adds the parts to cells.
class Collector {
public:
    explicit Collector(bool exact) : exact_(exact) {}

    void add(const std::array<Vec3<double>, 3>& points,
             const std::array<std::span<const Influence<float>>, 3>& influences) {
        bones_.clear();
        for (const auto& of_corner : influences) {
            for (const Influence<float>& influence : of_corner) {
                if (std::ranges::find(bones_, influence.bone) == bones_.end())
                    bones_.push_back(influence.bone);
            }
        }
        // A triangle of a single bone has no pairs.
        if (bones_.size() < 2) return;
        std::ranges::sort(bones_);
        pairs_.assign(bones_.size() * bones_.size(), kNone);
        weights_.assign(3 * bones_.size(), 0.0);
        for (std::size_t corner = 0; corner < 3; ++corner) {
            for (const Influence<float>& influence : influences[corner]) {
                const auto bone = static_cast<std::size_t>(std::ranges::lower_bound(bones_, influence.bone) -
                                                           bones_.begin());
                weights_[corner * bones_.size() + bone] += static_cast<double>(influence.weight);
            }
        }
        split(points, {0, bones_.size(), 2 * bones_.size()});
    }

    [[nodiscard]] const PairNumbers& pairs() const { return numbers_; }
    [[nodiscard]] const std::vector<Cell>& cells() const { return cells_; }

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    using Points = std::array<Vec3<double>, 3>;
    using Corners = std::array<std::size_t, 3>;  // index into weights_ where each corner's weights start

    void split(const Points& points, const Corners& corners) {
        std::size_t widest = 0;
        double most = -1.0;
        for (std::size_t edge = 0; edge < 3; ++edge) {
            const double square = squared_difference(corners[edge], corners[(edge + 1) % 3]);
            if (square > most) {
                most = square;
                widest = edge;
            }
        }
        if (most < kSplit * kSplit) return add_leaf(points, corners);
        const std::size_t next = (widest + 1) % 3;
        const std::size_t middle = weights_.size();
        for (std::size_t i = 0; i < bones_.size(); ++i) {
            weights_.push_back(0.5 * (weights_[corners[widest] + i] + weights_[corners[next] + i]));
        }
        for (const std::size_t replaced : {next, widest}) {
            Points half = points;
            half[replaced] = 0.5 * (points[widest] + points[next]);
            Corners of_half = corners;
            of_half[replaced] = middle;
            split(half, of_half);
        }
        weights_.resize(middle);
    }

    [[nodiscard]] double squared_difference(std::size_t a, std::size_t b) const {
        double sum = 0.0;
        for (std::size_t i = 0; i < bones_.size(); ++i) {
            const double difference = weights_[a + i] - weights_[b + i];
            sum += difference * difference;
        }
        return sum;
    }

    void add_leaf(const Points& points, const Corners& corners) {
        const double area = 0.5 * glm::length(glm::cross(points[1] - points[0], points[2] - points[0]));
        if (!(area > 0.0)) return;
        const Vec3<double> centroid = (points[0] + points[1] + points[2]) / 3.0;
        const auto mean = [&](std::size_t i) {
            return (weights_[corners[0] + i] + weights_[corners[1] + i] + weights_[corners[2] + i]) / 3.0;
        };
        const std::size_t count = bones_.size();
        for (std::size_t j = 0; j < count; ++j) {
            const double first = mean(j);
            if (first <= 0.0) continue;
            for (std::size_t k = j + 1; k < count; ++k) {
                const double second = mean(k);
                if (second <= 0.0) continue;
                std::uint32_t& pair = pairs_[j * count + k];
                if (pair == kNone) pair = numbers_.find_or_add(bones_[j], bones_[k]);
                Cell& cell = cell_of(pair, first, second);
                const double mass = area * first * second;
                cell.mass += mass;
                cell.centroids += mass * centroid;
                cell.first += mass * first;
                cell.second += mass * second;
            }
        }
    }

    Cell& cell_of(std::uint32_t pair, double first, double second) {
        const auto next = static_cast<std::uint32_t>(cells_.size());
        std::uint32_t cell = next;
        if (!exact_) {
            const auto rounded = [](double weight) {
                return static_cast<std::uint64_t>(std::lround(weight * kCellsOfOne));
            };
            const std::uint64_t key =
                static_cast<std::uint64_t>(pair) << 16 | rounded(first) << 8 | rounded(second);
            cell = known_.try_emplace(key, next).first->second;
        }
        if (cell == next) cells_.push_back({pair, 0.0, Vec3<double>(0.0), 0.0, 0.0});
        return cells_[cell];
    }

    bool exact_;
    PairNumbers numbers_;
    std::vector<Cell> cells_;
    std::unordered_map<std::uint64_t, std::uint32_t> known_;  // by their pair and rounded weights
    // Scratch for the current triangle.
    std::vector<std::int32_t> bones_;   // ascending
    std::vector<std::uint32_t> pairs_;  // [bones][bones] their numbers
    // [corners][bones], followed by those of the midpoints of halved edges
    std::vector<double> weights_;
};

/// exp(-y) for y >= 0, to 2e-7; 0 from 2^-126 on. Without a branch, so that compilers vectorise it.
inline float exponential(float y) {
    const float t = std::min(y * 1.44269504f, 127.0f);
    const auto whole = static_cast<std::int32_t>(t);
    const float x = static_cast<float>(whole) - t;  // 2^x, x from -1 to 0
    const float power =
        1.0f +
        x * (0.693147181f +
             x * (0.240226507f +
                  x * (0.0555041087f + x * (0.00961812911f + x * (0.00133335581f + x * 0.000154035304f)))));
    return power * std::bit_cast<float>((127 - whole) << 23);
}

inline double exponential(double y) { return std::exp(-y); }

/// The cells of all pairs, pair by pair, in strips of kStrip. A pair's last strip is padded with cells of mass 0.
template <class T>
class PairSums {
public:
    PairSums(const std::vector<Cell>& cells, std::size_t pairs, const Vec3<double>& origin)
        : starts_(pairs + 1) {
        std::vector<std::size_t> counts(pairs);
        double total = 0.0;
        for (const Cell& cell : cells) {
            ++counts[cell.pair];
            total += cell.mass;
        }
        for (std::size_t pair = 0; pair < pairs; ++pair) {
            starts_[pair + 1] = starts_[pair] + (counts[pair] + kStrip - 1) / kStrip;
        }
        strips_.resize(starts_.back());
        std::vector<std::size_t> next(pairs);
        for (const Cell& cell : cells) {
            const std::size_t i = next[cell.pair]++;
            Strip& strip = strips_[starts_[cell.pair] + i / kStrip];
            const std::size_t lane = i % kStrip;
            // Relative to the total, as areas may have any magnitude.
            const double mass = cell.mass / total;
            const Vec3<double> moment = mass * (cell.centroids / cell.mass - origin);
            strip.first[lane] = static_cast<T>(cell.first / (cell.mass * kSigma));
            strip.second[lane] = static_cast<T>(cell.second / (cell.mass * kSigma));
            strip.mass[lane] = static_cast<T>(mass);
            for (int axis = 0; axis < 3; ++axis) {
                strip.moment[static_cast<std::size_t>(axis)][lane] = static_cast<T>(moment[axis]);
            }
        }
    }

    /// Adds the contribution of `pair` at a vertex with these weights to the mass and to the moment about the
    /// origin.
    void add(std::size_t pair, double first, double second, double& mass, Vec3<double>& moment) const {
        const auto a = static_cast<T>(first);
        const auto b = static_cast<T>(second);
        T sums[4][kStrip] = {};
        for (std::size_t s = starts_[pair]; s < starts_[pair + 1]; ++s) {
            const Strip& strip = strips_[s];
            T near[kStrip];
            for (std::size_t i = 0; i < kStrip; ++i) {
                const T difference = a * strip.second[i] - b * strip.first[i];
                near[i] = exponential(difference * difference);
            }
            for (std::size_t i = 0; i < kStrip; ++i) sums[3][i] += near[i] * strip.mass[i];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (std::size_t i = 0; i < kStrip; ++i) sums[axis][i] += near[i] * strip.moment[axis][i];
            }
        }
        const double product = first * second;
        for (std::size_t i = 0; i < kStrip; ++i) {
            mass += product * static_cast<double>(sums[3][i]);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                moment[static_cast<int>(axis)] += product * static_cast<double>(sums[axis][i]);
            }
        }
    }

private:
    struct Strip {
        std::array<T, kStrip> first{};  // weights of the pair's bones over sigma
        std::array<T, kStrip> second{};
        std::array<T, kStrip> mass{};
        std::array<std::array<T, kStrip>, 3> moment{};
    };
    std::vector<std::size_t> starts_;  // [pairs + 1] into strips_
    std::vector<Strip> strips_;
};

Vec3<double> mean_of(std::span<const Vec3<float>> points) {
    Vec3<double> sum(0.0);
    for (const Vec3<float>& point : points) sum += Vec3<double>(point);
    return points.empty() ? sum : sum / static_cast<double>(points.size());
}

template <class T>
std::vector<Vec3<float>> find_centres(const BindData& data, const NormalisedInfluences& influences,
                                      const Collector& collector, Job& job) {
    std::vector<Vec3<float>> centres(data.rest_points.size());
    const Vec3<double> origin = mean_of(data.rest_points);
    const PairSums<T> sums(collector.cells(), collector.pairs().count(), origin);
    std::atomic<std::size_t> done{0};
    job.for_each(centres.size(), kVerticesOfAChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<Influence<double>> of_vertex;
        for (std::size_t vertex = begin; vertex < end; ++vertex) {
            const std::span all(influences.influences);
            merge(all.subspan(influences.offsets[vertex],
                              influences.offsets[vertex + 1] - influences.offsets[vertex]),
                  of_vertex);
            std::ranges::sort(of_vertex, {}, &Influence<double>::bone);
            double mass = 0.0;
            Vec3<double> moment(0.0);
            for (std::size_t j = 0; j < of_vertex.size(); ++j) {
                for (std::size_t k = j + 1; k < of_vertex.size(); ++k) {
                    if (const auto* pair = collector.pairs().find(of_vertex[j].bone, of_vertex[k].bone)) {
                        sums.add(*pair, of_vertex[j].weight, of_vertex[k].weight, mass, moment);
                    }
                }
            }
            centres[vertex] = mass > 0.0 ? Vec3<float>(origin + moment / mass) : data.rest_points[vertex];
        }
        const std::size_t all = done.fetch_add(end - begin, std::memory_order_relaxed) + end - begin;
        job.report_progress(0.5 + 0.5 * static_cast<double>(all) / static_cast<double>(centres.size()));
    });
    return centres;
}

}  // namespace

std::vector<Vec3<float>> centres_of_rotation(const BindData& data, std::span<const std::int32_t> triangles,
                                             Job& job, bool exact) {
    check(data);
    check_triangles(triangles, data.rest_points.size());
    const NormalisedInfluences influences = normalised_influences(data);
    Collector collector(exact);
    for (std::size_t i = 0; i < triangles.size(); i += 3) {
        if (i / 3 % kTrianglesBetweenReports == 0 &&
            !job.report_progress(0.5 * static_cast<double>(i) / static_cast<double>(triangles.size()))) {
            return {};
        }
        std::array<Vec3<double>, 3> points;
        std::array<std::span<const Influence<float>>, 3> of_corners;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const auto vertex = static_cast<std::size_t>(triangles[i + corner]);
            points[corner] = Vec3<double>(data.rest_points[vertex]);
            of_corners[corner] = std::span(influences.influences)
                                     .subspan(influences.offsets[vertex],
                                              influences.offsets[vertex + 1] - influences.offsets[vertex]);
        }
        collector.add(points, of_corners);
    }
    return exact ? find_centres<double>(data, influences, collector, job)
                 : find_centres<float>(data, influences, collector, job);
}

}  // namespace sinew
