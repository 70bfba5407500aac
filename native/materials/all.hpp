// Every material, in one list: a new one is added here and nowhere else in C++.
#pragma once

#include "materials/stable_neo_hookean.hpp"

namespace qlb {

template <template <class> class... Materials>
struct MaterialList {};

using AllMaterials = MaterialList<StableNeoHookean>;

}  // namespace qlb
