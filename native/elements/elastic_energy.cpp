#include "elements/elastic_energy.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>

#include "elements/dispatch.hpp"
#include "elements/slot_sums.hpp"

namespace qlb {
namespace {

// Waking a thread costs about as much as four chunks of work.
int threads_worth(std::size_t chunks, int threads) {
  return std::max(1, std::min(threads, static_cast<int>(chunks / 4)));
}

}  // namespace

ElasticEnergy::ElasticEnergy(std::shared_ptr<const TetBlocks> blocks, const std::string& material,
                             std::span<const double> parameters, int threads, const std::string& simd_level,
                             std::shared_ptr<const OwnedProgram> program)
    : blocks_(std::move(blocks)),
      kernels_(&find_kernels(material, simd_level)),
      program_(std::move(program)),
      parameter_count_(parameter_count(*kernels_, this->program())),
      threads_(threads_worth(blocks_->chunks.size(), threads)) {
  if (static_cast<std::int64_t>(parameters.size()) != blocks_->elements * parameter_count_)
    throw std::invalid_argument("material '" + material + "' takes " + std::to_string(parameter_count_) +
                                " parameters per element");
  parameters_ = blocks_->scatter(parameters, parameter_count_);
  positions_.resize(kStride * blocks_->slot_node.size());
  slot_gradient_.resize(kStride * blocks_->slot_node.size());
  chunk_energy_.resize(blocks_->chunks.size());
}

ChunkData ElasticEnergy::chunk_data(const Chunk& c) const {
  ChunkData data = chunk_geometry(*blocks_, c);
  data.parameters = parameters_.data() + c.first_pack * parameter_count_ * kLanes;
  data.program = program();
  return data;
}

template <class Kernel>
void ElasticEnergy::for_each_chunk(const Kernel& kernel) {
  const auto count = static_cast<std::int64_t>(blocks_->chunks.size());
#pragma omp parallel for schedule(dynamic) num_threads(threads_)
  for (std::int64_t k = 0; k < count; ++k) {
    const Chunk& chunk = blocks_->chunks[k];
    kernel(k, chunk, chunk_data(chunk), positions_.data() + kStride * chunk.first_slot);
  }
}

double ElasticEnergy::value(const double* x) {
  for_each_chunk([&](std::int64_t k, const Chunk&, const ChunkData& data, double* scratch) {
    chunk_energy_[k] = kernels_->value(data, x, scratch);
  });
  return std::accumulate(chunk_energy_.begin(), chunk_energy_.end(), 0.0);
}

double ElasticEnergy::add_value_gradient(const double* x, double scale, double* gradient) {
  for_each_chunk([&](std::int64_t k, const Chunk& chunk, const ChunkData& data, double* scratch) {
    chunk_energy_[k] = kernels_->value_gradient(data, x, scratch, slot_gradient_.data() + kStride * chunk.first_slot);
  });
  return sum_chunks(scale, gradient);
}

double ElasticEnergy::add_value_gradient(const double* x, const ElasticEnergy& viscosity, double scale,
                                         double* gradient) {
  if (viscosity.blocks_ != blocks_) throw std::invalid_argument("viscosity: of other elements");
  if (std::string_view(viscosity.kernels_->name) != "viscous")
    throw std::invalid_argument("viscosity: of material '" + std::string(viscosity.kernels_->name) + "'");
  for_each_chunk([&](std::int64_t k, const Chunk& chunk, const ChunkData& data, double* scratch) {
    chunk_energy_[k] = kernels_->viscous_value_gradient(data, viscosity.chunk_data(chunk).parameters, x, scratch,
                                                        slot_gradient_.data() + kStride * chunk.first_slot);
  });
  return sum_chunks(scale, gradient);
}

double ElasticEnergy::sum_chunks(double scale, double* gradient) {
  add_slots<3, kStride>(blocks_->node_slots, slot_gradient_.data(), scale, gradient, threads_);
  return scale * std::accumulate(chunk_energy_.begin(), chunk_energy_.end(), 0.0);
}

void ElasticEnergy::add_hessian(const double* x, double scale, bool project, BlockMatrix& matrix) {
  if (matrix.pattern().blocks() + 1 != static_cast<std::int64_t>(blocks_->block_slots.begin.size()))
    throw std::invalid_argument("the matrix has another pattern than the elements");
  slot_blocks_.resize(9 * blocks_->block_slots.slot.size());
  for_each_chunk([&](std::int64_t, const Chunk& chunk, const ChunkData& data, double* scratch) {
    kernels_->hessian(data, x, project, scratch, slot_blocks_.data() + 9 * chunk.first_block_slot);
  });
  add_slots<9>(blocks_->block_slots, slot_blocks_.data(), scale, matrix.values(), threads_);
}

}  // namespace qlb
