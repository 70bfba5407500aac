// Psi(x) = sum over elements of rest volume times energy density, with its derivatives.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "assembly/block_matrix.hpp"
#include "elements/kernels.hpp"
#include "elements/tet_blocks.hpp"
#include "materials/owned_program.hpp"

namespace qlb {

class ElasticEnergy {
 public:
  // parameters (elements, count) as the material wants them; a program for a material that takes one.
  ElasticEnergy(std::shared_ptr<const TetBlocks> blocks, const std::string& material,
                std::span<const double> parameters, int threads, const std::string& simd_level,
                std::shared_ptr<const OwnedProgram> program);

  double value(const double* x);  // [J]
  // gradient += scale dPsi/dx; returns scale Psi.
  double add_value_gradient(const double* x, double scale, double* gradient);
  // The same of the sum of this and of `viscosity`, the energy of material Viscous over the same elements, in one loop.
  double add_value_gradient(const double* x, const ElasticEnergy& viscosity, double scale, double* gradient);
  void add_hessian(const double* x, double scale, bool project, BlockMatrix& matrix);

  std::int64_t nodes() const { return blocks_->nodes; }

 protected:
  double* parameters() { return parameters_.data(); }  // (packs, count, kLanes)

 private:
  const Program* program() const { return program_ ? &program_->view() : nullptr; }
  ChunkData chunk_data(const Chunk& chunk) const;
  // kernel(chunk, data, scratch) over all chunks in parallel.
  template <class Kernel>
  void for_each_chunk(const Kernel& kernel);
  double sum_chunks(double scale, double* gradient);  // of what a kernel has left

  std::shared_ptr<const TetBlocks> blocks_;
  const MaterialKernels* kernels_;
  std::shared_ptr<const OwnedProgram> program_;  // may be null
  std::int64_t parameter_count_;
  Aligned<double> parameters_;
  int threads_;
  Aligned<double> positions_;      // (slots, kStride)
  Aligned<double> slot_gradient_;  // (slots, kStride)
  Aligned<double> slot_blocks_;    // (block slots, 3, 3)
  std::vector<double> chunk_energy_;
};

}  // namespace qlb
