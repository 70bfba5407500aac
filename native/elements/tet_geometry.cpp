#include "elements/tet_geometry.hpp"

#include <algorithm>

#include "elements/dispatch.hpp"
#include "elements/slot_sums.hpp"

namespace qlb {

TetGeometry::TetGeometry(std::shared_ptr<const TetBlocks> blocks, int threads)
    : blocks_(std::move(blocks)), kernels_(&geometry_kernels()), threads_(threads) {
  positions_.resize(2 * kStride * blocks_->slot_node.size());
  slot_sums_.resize(9 * blocks_->slot_node.size());
  const std::vector<std::int64_t>& begin = blocks_->node_slots.begin;
  for (std::int64_t i = 0; i < nodes(); ++i)
    if (begin[i] == begin[i + 1]) loose_nodes_.push_back(i);
}

double TetGeometry::least_J(const double* x) {
  const auto chunks = static_cast<std::int64_t>(blocks_->chunks.size());
  std::vector<double> least(chunks);
#pragma omp parallel for schedule(dynamic) num_threads(threads_)
  for (std::int64_t k = 0; k < chunks; ++k) {
    const Chunk& chunk = blocks_->chunks[k];
    double* scratch = positions_.data() + 2 * kStride * chunk.first_slot;
    least[k] = kernels_->least_J(chunk_geometry(*blocks_, chunk), x, scratch);
  }
  double result = least[0];
  for (const double J : least) result = J < result || J != J ? J : result;
  return result;
}

void TetGeometry::correlations(const double* x, const double* reference, double* sums) {
  const auto chunks = static_cast<std::int64_t>(blocks_->chunks.size());
#pragma omp parallel for schedule(dynamic) num_threads(threads_)
  for (std::int64_t k = 0; k < chunks; ++k) {
    const Chunk& chunk = blocks_->chunks[k];
    kernels_->correlations(chunk_geometry(*blocks_, chunk), x, reference,
                           positions_.data() + 2 * kStride * chunk.first_slot,
                           slot_sums_.data() + 9 * chunk.first_slot);
  }
  std::fill(sums, sums + 9 * nodes(), 0.0);
  add_slots<9>(blocks_->node_slots, slot_sums_.data(), 1.0, sums, threads_);
  for (const std::int64_t i : loose_nodes_)
    for (int k = 0; k < 3; ++k) sums[9 * i + 4 * k] = 1.0;
}

void TetGeometry::nodal_maps(const double* x, const double* reference, double weight, double* maps) {
  if (reference_.empty() || !std::equal(reference_.begin(), reference_.end(), reference)) {
    reference_.assign(reference, reference + 3 * nodes());
    reference_sums_.resize(9 * nodes());
    correlations(reference, reference, reference_sums_.data());
  }
  correlations(x, reference, maps);
  constexpr std::int64_t kBatch = 1024;
#pragma omp parallel for schedule(static) num_threads(threads_)
  for (std::int64_t first = 0; first < nodes(); first += kBatch)
    kernels_->nodal_maps(maps + 9 * first, reference_sums_.data() + 9 * first, std::min(nodes() - first, kBatch),
                         weight);
}

}  // namespace qlb
