#pragma once

#include "kernels/bodies/index.hpp"

namespace talus {

/// Number of a subdomain, from 0; the same on every rank. Its place among the subdomains of one rank is
/// another kind of number (runtime/step/decomposition.hpp).
using SubdomainId = Index<struct SubdomainTag>;

}  // namespace talus
