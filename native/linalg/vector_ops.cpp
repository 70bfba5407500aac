#include "linalg/vector_ops.hpp"

#include <algorithm>
#include <vector>

#include "linalg/dense_kernels.hpp"

namespace qlb {
namespace {

// Entries worked on together: the grouping, and so every sum, is the same for any number of threads.
constexpr std::int64_t kGroup = 8192;

const DenseKernels<double>& kernels() {
  static const DenseKernels<double>& found = find_dense_kernels<double>();
  return found;
}

}  // namespace

double dot(const double* a, const double* b, std::int64_t n, int threads) {
  const std::int64_t groups = (n + kGroup - 1) / kGroup;
  const auto of_group = [&, dot = kernels().dot](std::int64_t g) {
    return dot(a + g * kGroup, b + g * kGroup, std::min(kGroup, n - g * kGroup));
  };
  double total = 0.0;
  if (threads == 1 || groups <= 4) {
    for (std::int64_t g = 0; g < groups; ++g) total += of_group(g);
    return total;
  }
  thread_local std::vector<double> storage;
  storage.resize(groups);
  double* partial = storage.data();
#pragma omp parallel for schedule(static) num_threads(threads)
  for (std::int64_t g = 0; g < groups; ++g) partial[g] = of_group(g);
  for (std::int64_t g = 0; g < groups; ++g) total += partial[g];
  return total;
}

void add_scaled(double scale, const double* a, double* b, std::int64_t n, int threads) {
  const std::int64_t groups = (n + kGroup - 1) / kGroup;
  const auto add = kernels().add_scaled;
#pragma omp parallel for schedule(static) num_threads(threads) if (groups > 4 && threads > 1)
  for (std::int64_t g = 0; g < groups; ++g)
    add(scale, a + g * kGroup, b + g * kGroup, std::min(kGroup, n - g * kGroup));
}

}  // namespace qlb
