// The doors between the element kernels, compiled once per SIMD level, and everything else.
#pragma once

#include <cstdint>

#include "materials/program.hpp"

namespace qlb {

// One chunk of TetBlocks, as plain pointers.
struct ChunkData {
  const std::int64_t* vertex;
  const std::int32_t* pair;
  const double* shape;
  const double* volume;
  const double* parameters;
  std::int64_t packs;
  const std::int32_t* slot_node;
  std::int64_t slots;
  std::int64_t block_slots;
  const Program* program;  // for a material that takes one, else null
};

// How many parameters an element has where the program of the material says it.
inline constexpr int kAsProgram = -1;

// Kernels of one material at one SIMD level. `scratch` holds 4 * slots doubles.
struct MaterialKernels {
  const char* name;
  int parameter_count;
  double (*value)(const ChunkData&, const double* x, double* scratch);
  // slot_gradient: (slots, kStride), aligned to 32 bytes, overwritten
  double (*value_gradient)(const ChunkData&, const double* x, double* scratch, double* slot_gradient);
  // of the material and, with the parameters of Viscous, of viscosity
  double (*viscous_value_gradient)(const ChunkData&, const double* viscosity, const double* x, double* scratch,
                                   double* slot_gradient);
  // slot_blocks: (block_slots, 3, 3), overwritten
  void (*hessian)(const ChunkData&, const double* x, bool project, double* scratch, double* slot_blocks);
  // The density itself at kLanes deformation gradients: F (9, kLanes), parameters (count, kLanes) ->
  // energy (kLanes), stress (9, kLanes), stiffness (81, kLanes)
  void (*density)(const double* F, const double* parameters, const Program* program, bool project, double* energy,
                  double* stress, double* stiffness);
};

// Kernels of the geometry alone (geometry_kernels.hpp).
struct GeometryKernels {
  double (*least_J)(const ChunkData&, const double* x, double* scratch);
  void (*correlations)(const ChunkData&, const double* x, const double* reference, double* scratch, double* slot_sums);
  void (*nodal_maps)(double* maps, const double* reference, std::int64_t count, double weight);
};

struct KernelSet {
  const MaterialKernels* materials;  // ended by an entry whose name is null
  GeometryKernels geometry;
};

const KernelSet& kernels_SSE2();
const KernelSet& kernels_AVX2();
const KernelSet& kernels_AVX512();
const KernelSet& kernels_NEON64();

}  // namespace qlb
