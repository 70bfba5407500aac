// Long-vector operations whose result does not depend on the number of threads.
#pragma once

#include <cstdint>

namespace qlb {

double dot(const double* a, const double* b, std::int64_t n, int threads);
void add_scaled(double scale, const double* a, double* b, std::int64_t n, int threads);  // b += scale a

}  // namespace qlb
