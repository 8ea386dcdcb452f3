#pragma once

/// Steady flows of periodic cells: what cases of shear share.

#include <functional>

#include "apps/validate/cell_run.hpp"

namespace talus::literature {

/// What a steady flow comes to, each over the second half of the strain and over seeds.
struct Steady {
  Mean ratio, q_over_p, solid_fraction, coordination;
  Mean forces, products;  ///< q/p by the anisotropies: 0.4 (a_c + a_n + 1.5 a_t), and with their products
};

struct FlowPlan {
  std::int64_t grains;
  double friction_of_press, friction, rate, strain;
  bool triaxial = false;  ///< compression along z; else simple shear
};

/// Runs the plan with every seed; `look` sees each run. Steps are added to `result`.
Steady flow(const FlowPlan& plan, const Effort& effort, CaseResult& result,
            const std::function<void(const CellRun&)>& look = {});

/// I of slow flow: slower ones take ten times as long, and change the ratio by less than it scatters.
inline constexpr double slow = 3e-3;

io::Chart chart_of(const std::string& name, const std::string& title, const std::string& x,
                   const std::string& y);

}  // namespace talus::literature
