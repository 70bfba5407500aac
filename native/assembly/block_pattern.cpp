#include "assembly/block_pattern.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace qlb {

BlockPattern::BlockPattern(std::int64_t nodes, std::span<const std::int32_t> cliques, std::int64_t width)
    : nodes_(nodes) {
  for (const std::int32_t node : cliques)
    if (node < 0 || node >= nodes)
      throw std::invalid_argument("node index " + std::to_string(node) + " is outside [0, " + std::to_string(nodes) +
                                  ")");

  // Two passes over all pairs: count the entries of each column, then fill; duplicates go in the sort below.
  const auto for_each_pair = [&](auto&& visit) {
    for (std::int32_t i = 0; i < nodes; ++i) visit(i, i);
    for (std::size_t first = 0; first < cliques.size(); first += width)
      for (std::int64_t a = 0; a < width; ++a)
        for (std::int64_t b = 0; b < a; ++b) {
          const auto [low, high] = std::minmax(cliques[first + a], cliques[first + b]);
          if (low != high) visit(high, low);
        }
  };
  std::vector<std::int64_t> begin(nodes + 1, 0);
  for_each_pair([&](std::int32_t, std::int32_t column) { ++begin[column + 1]; });
  for (std::int64_t j = 0; j < nodes; ++j) begin[j + 1] += begin[j];
  std::vector<std::int32_t> all(begin.back());
  std::vector<std::int64_t> next(begin.begin(), begin.end() - 1);
  for_each_pair([&](std::int32_t row, std::int32_t column) { all[next[column]++] = row; });

  column_begin_.assign(nodes + 1, 0);
  row_.reserve(all.size() / 3);
  for (std::int64_t j = 0; j < nodes; ++j) {
    const auto first = all.begin() + begin[j], last = all.begin() + begin[j + 1];
    std::sort(first, last);
    row_.insert(row_.end(), first, std::unique(first, last));
    column_begin_[j + 1] = static_cast<std::int64_t>(row_.size());
  }
  row_.shrink_to_fit();
}

std::int64_t BlockPattern::find(std::int32_t i, std::int32_t j) const {
  const auto [column, row] = std::minmax(i, j);
  const auto first = row_.begin() + column_begin_[column], last = row_.begin() + column_begin_[column + 1];
  const auto found = std::lower_bound(first, last, row);
  if (found == last || *found != row)
    throw std::out_of_range("block (" + std::to_string(i) + ", " + std::to_string(j) + ") is not in the pattern");
  return found - row_.begin();
}

}  // namespace qlb
