// How the material at each node has moved since a factor was made: T, block-diagonal with a map for each node
// (TetGeometry::nodal_maps).
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "elements/tet_geometry.hpp"
#include "simd/aligned.hpp"

namespace qlb {

class MaterialFrame {
 public:
  // fixed: (nodes, 3); a node with a held axis keeps T = 1, so that what is held stays held.
  MaterialFrame(std::shared_ptr<const TetBlocks> blocks, std::span<const std::uint8_t> fixed, int threads);

  // T from how the material has moved between `reference` and x, all (nodes, 3).
  void carry(const double* x, const double* reference, double weight);
  // T = 1
  void reset() { carried_ = false; }

  std::int64_t nodes() const { return geometry_.nodes(); }
  bool carried() const { return carried_; }
  void pull_back(const double* v, double* out) const;     // out = T^T v
  void push_forward(const double* v, double* out) const;  // out = T v
  std::array<double, 3> pull_back_at(std::int64_t node, const std::array<double, 3>& v) const;

 private:
  // out = product(T, v) at each node
  template <auto product>
  void at_each_node(const double* v, double* out) const;

  TetGeometry geometry_;
  std::vector<std::int64_t> held_nodes_;
  int threads_;
  bool carried_ = false;
  Aligned<double> maps_;  // (nodes, 3, 3), row by row
};

}  // namespace qlb
