#include "elements/dispatch.hpp"

#include <stdexcept>

namespace qlb {
namespace {

struct Level {
  std::string name;
  const KernelSet* set;
};

std::vector<Level> usable_levels() {
  std::vector<Level> levels;
#ifdef QLB_HAS_SSE2
  levels.push_back({"sse2", &kernels_SSE2()});
#endif
#ifdef QLB_HAS_AVX2
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) levels.push_back({"avx2", &kernels_AVX2()});
#endif
#ifdef QLB_HAS_AVX512
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("fma"))
    levels.push_back({"avx512", &kernels_AVX512()});
#endif
#ifdef QLB_HAS_NEON64
  levels.push_back({"neon64", &kernels_NEON64()});
#endif
  return levels;
}

}  // namespace

std::vector<std::string> simd_levels() {
  std::vector<std::string> names;
  for (const Level& level : usable_levels()) names.push_back(level.name);
  return names;
}

const MaterialKernels& find_kernels(const std::string& material, const std::string& level) {
  const std::vector<Level> levels = usable_levels();
  const std::string& wanted = level.empty() ? levels.back().name : level;
  for (const Level& candidate : levels) {
    if (candidate.name != wanted) continue;
    for (const MaterialKernels* k = candidate.set->materials; k->name; ++k)
      if (material == k->name) return *k;
    throw std::invalid_argument("no kernels for material '" + material + "'");
  }
  throw std::invalid_argument("SIMD level '" + wanted + "' is not available here");
}

const GeometryKernels& geometry_kernels() {
  return usable_levels().back().set->geometry;
}

std::vector<std::string> material_names() {
  std::vector<std::string> names;
  for (const MaterialKernels* k = usable_levels().back().set->materials; k->name; ++k) names.push_back(k->name);
  return names;
}

int parameter_count(const MaterialKernels& kernels, const Program* program) {
  const bool takes_program = kernels.parameter_count == kAsProgram;
  if (takes_program != (program != nullptr))
    throw std::invalid_argument("material '" + std::string(kernels.name) +
                                (takes_program ? "' needs a program" : "' takes no program"));
  return takes_program ? program->parameter_count : kernels.parameter_count;
}

}  // namespace qlb
