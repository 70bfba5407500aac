// Picks the element kernels for the SIMD level of the machine.
#pragma once

#include <string>
#include <vector>

#include "elements/kernels.hpp"

namespace qlb {

// Levels that were built and that this machine can run, best last: "sse2", "avx2", "avx512" or "neon64".
std::vector<std::string> simd_levels();
// Throws std::invalid_argument for a material or a level that is not there; an empty level means the best.
const MaterialKernels& find_kernels(const std::string& material, const std::string& level = "");
// Those of the best level.
const GeometryKernels& geometry_kernels();
std::vector<std::string> material_names();
// Parameters of each element. Throws std::invalid_argument where a program is missing, or given to a material that
// takes none.
int parameter_count(const MaterialKernels& kernels, const Program* program);

}  // namespace qlb
