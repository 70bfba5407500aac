#include "linalg/ordering.hpp"

#include <metis.h>

#include <stdexcept>

namespace qlb {

std::vector<std::int32_t> nested_dissection(const BlockPattern& pattern, std::span<const std::uint8_t> fixed) {
  const std::int64_t nodes = pattern.nodes();
  std::vector<idx_t> rank(nodes, -1), node_of;
  for (std::int64_t i = 0; i < nodes; ++i) {
    if (fixed[3 * i] && fixed[3 * i + 1] && fixed[3 * i + 2]) continue;
    rank[i] = static_cast<idx_t>(node_of.size());
    node_of.push_back(static_cast<idx_t>(i));
  }
  idx_t count = static_cast<idx_t>(node_of.size());

  const auto for_each_edge = [&](auto&& visit) {
    for (std::int64_t j = 0; j < nodes; ++j)
      for (std::int64_t k = pattern.column_begin()[j] + 1; k < pattern.column_begin()[j + 1]; ++k)
        if (rank[j] >= 0 && rank[pattern.rows()[k]] >= 0) visit(rank[j], rank[pattern.rows()[k]]);
  };
  std::vector<idx_t> begin(count + 1, 0);
  for_each_edge([&](idx_t a, idx_t b) { ++begin[a + 1], ++begin[b + 1]; });
  for (idx_t i = 0; i < count; ++i) begin[i + 1] += begin[i];
  std::vector<idx_t> neighbour(begin[count]), next(begin.begin(), begin.end());
  for_each_edge([&](idx_t a, idx_t b) { neighbour[next[a]++] = b, neighbour[next[b]++] = a; });

  std::vector<idx_t> order(count), inverse(count);
  if (neighbour.empty()) {
    for (idx_t i = 0; i < count; ++i) order[i] = i;
  } else {
    idx_t options[METIS_NOPTIONS];
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_NUMBERING] = 0;
    options[METIS_OPTION_SEED] = 1;
    if (METIS_NodeND(&count, begin.data(), neighbour.data(), nullptr, options, order.data(), inverse.data()) !=
        METIS_OK)
      throw std::runtime_error("METIS could not order the matrix");
  }

  std::vector<std::int32_t> result;
  for (const idx_t k : order) result.push_back(static_cast<std::int32_t>(node_of[k]));
  for (std::int64_t i = 0; i < nodes; ++i)
    if (rank[i] < 0) result.push_back(static_cast<std::int32_t>(i));
  return result;
}

std::vector<std::int64_t> free_dofs(std::span<const std::int32_t> node_order, std::span<const std::uint8_t> fixed) {
  std::vector<std::int64_t> dofs;
  for (const std::int32_t node : node_order)
    for (std::int64_t dof = 3 * std::int64_t{node}; dof < 3 * std::int64_t{node} + 3; ++dof)
      if (!fixed[dof]) dofs.push_back(dof);
  return dofs;
}

}  // namespace qlb
