// Fill-reducing order of the free degrees of freedom.
#pragma once

#include <span>
#include <vector>

#include "assembly/block_pattern.hpp"

namespace qlb {

// Nested dissection (METIS) of the graph of nodes that have a free degree of freedom; the nodes that are wholly held
// follow. Expanding each node to its degrees of freedom then gives several times less fill than ordering these one by
// one. fixed: (nodes, 3), nonzero where held.
std::vector<std::int32_t> nested_dissection(const BlockPattern& pattern, std::span<const std::uint8_t> fixed);

// The free degrees of freedom (3 node + axis) of the nodes, in their order.
std::vector<std::int64_t> free_dofs(std::span<const std::int32_t> node_order, std::span<const std::uint8_t> fixed);

}  // namespace qlb
