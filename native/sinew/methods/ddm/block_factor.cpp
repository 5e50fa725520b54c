// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/methods/ddm/block_factor.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace sinew {
namespace {

// The rows of one block then fit into the first-level cache together with the right sides that they change.
constexpr std::size_t kMaxColumns = 32;

// Share of zeros that a block may store: up to this share they cost less than one more block.
constexpr double kMaxZeros = 0.3;

class BlockMaker {
public:
    BlockMaker(std::span<const std::int32_t> starts, std::span<const std::int32_t> rows,
               std::span<const double> values, std::vector<double> diagonal)
        : starts_(starts), rows_(rows), values_(values) {
        factor_.diagonal = std::move(diagonal);
    }

    BlockFactor run() {
        const std::size_t columns = factor_.diagonal.size();
        for (std::size_t column = 0; column < columns; ++column) {
            if (column > begin_ && !add(column)) {
                close(column);
                begin_ = column;
            }
            if (column == begin_) {
                const auto of = rows_of(column);
                below_.assign(of.begin(), of.end());
                numbers_ = of.size();
            }
        }
        if (columns > 0) close(columns);
        return std::move(factor_);
    }

private:
    [[nodiscard]] std::span<const std::int32_t> rows_of(std::size_t column) const {
        const auto begin = static_cast<std::size_t>(starts_[column]);
        return rows_.subspan(begin, static_cast<std::size_t>(starts_[column + 1]) - begin);
    }

    /// Adds `column` to the block of columns from begin_ on, if that stores few enough zeros. Returns whether it
    /// did.
    bool add(std::size_t column) {
        const std::size_t width = column + 1 - begin_;
        if (width > kMaxColumns) return false;
        if (below_.empty() || below_.front() != static_cast<std::int32_t>(column)) return false;
        const auto of = rows_of(column);
        merged_.clear();
        std::set_union(below_.begin() + 1, below_.end(), of.begin(), of.end(), std::back_inserter(merged_));
        const std::size_t all = width * merged_.size() + BlockFactor::triangle(width);
        const std::size_t numbers = numbers_ + of.size();
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
            auto i = static_cast<std::size_t>(starts_[begin_ + k]);
            const auto last = static_cast<std::size_t>(starts_[begin_ + k + 1]);
            for (; i < last && static_cast<std::size_t>(rows_[i]) < end; ++i) {
                const std::size_t row = static_cast<std::size_t>(rows_[i]) - begin_;
                factor_.values[first_value + BlockFactor::triangle(row) + k] = values_[i];
            }
            for (std::size_t row = 0; i < last; ++i, ++row) {
                while (below_[row] != rows_[i]) ++row;
                factor_.values[below + width * row + k] = values_[i];
            }
        }
    }

    std::span<const std::int32_t> starts_;
    std::span<const std::int32_t> rows_;
    std::span<const double> values_;
    BlockFactor factor_;
    // The block of columns from begin_ on.
    std::size_t begin_ = 0;
    std::vector<std::int32_t> below_;
    std::size_t numbers_ = 0;
    std::vector<std::int32_t> merged_;
};

}  // namespace

BlockFactor make_block_factor(std::span<const std::int32_t> starts, std::span<const std::int32_t> rows,
                              std::span<const double> values, std::vector<double> diagonal) {
    return BlockMaker(starts, rows, values, std::move(diagonal)).run();
}

}  // namespace sinew
