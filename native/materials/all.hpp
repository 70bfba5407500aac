// Every material, in one list: a new one is added here and nowhere else in C++.
#pragma once

#include "materials/compressible_neo_hookean.hpp"
#include "materials/corotational.hpp"
#include "materials/fibres.hpp"
#include "materials/linear_elastic.hpp"
#include "materials/mooney_rivlin.hpp"
#include "materials/st_venant_kirchhoff.hpp"
#include "materials/stable_neo_hookean.hpp"
#include "materials/symbolic.hpp"
#include "materials/viscous.hpp"

namespace qlb {

template <template <class> class... Materials>
struct MaterialList {};

using AllMaterials =
    MaterialList<StableNeoHookean, StVenantKirchhoff, CompressibleNeoHookean, FixedCorotational, Arap, MooneyRivlin,
                 LinearElastic, FibreSqrtI5, FibreStVK, Symbolic, SymbolicWithI2, Viscous>;

}  // namespace qlb
