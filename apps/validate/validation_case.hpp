#pragma once

/// A case of `talus validate`: a few runs, and the numbers that they are judged by.

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "io/pictures/chart.hpp"
#include "kernels/registry.hpp"

namespace talus::literature {

/// How much a case may take.
struct Effort {
  bool brief = false;       ///< the short set: small samples, and bands that allow for their size
  int seeds = 5;            ///< runs that differ by the places of their grains alone, >= 1
  double size = 1;          ///< factor on the numbers of grains
  double tolerance = 1e-2;  ///< solver.tolerance
  int threads = 1;
};

/// One number. A band without ends is information: it is printed and not judged.
struct Measure {
  std::string quantity;  ///< what it is, with its unit
  double value = 0;
  double scatter = 0;  ///< standard error of the mean over seeds; 0 where there is one run
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  std::string source = {};  ///< of the band

  bool judged() const { return std::isfinite(low) || std::isfinite(high); }
  bool holds() const { return value >= low && value <= high; }
};

struct CaseResult {
  std::vector<Measure> measures;
  std::vector<io::Chart> charts;
  std::int64_t steps = 0, missed = 0;  ///< of all runs
};

using CaseMaker = CaseResult (*)(const Effort&);
using Case = Entry<std::string_view, CaseMaker>;
/// All cases, in the order in which they run.
const Registry<std::string_view, CaseMaker>& cases();

CaseResult lattice_case(const Effort& effort);
CaseResult free_cell_case(const Effort& effort);
CaseResult frictionless_packing_case(const Effort& effort);
CaseResult packing_of_two_sizes_case(const Effort& effort);
CaseResult frictional_packing_case(const Effort& effort);
CaseResult frictionless_shear_case(const Effort& effort);
CaseResult critical_state_case(const Effort& effort);
CaseResult triaxial_case(const Effort& effort);
CaseResult rheology_case(const Effort& effort);
CaseResult forces_case(const Effort& effort);
CaseResult tolerance_case(const Effort& effort);

}  // namespace talus::literature
