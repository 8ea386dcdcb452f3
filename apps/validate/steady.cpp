#include "apps/validate/steady.hpp"

#include <array>
#include <vector>

namespace talus::literature {

Steady flow(const FlowPlan& plan, const Effort& effort, CaseResult& result,
            const std::function<void(const CellRun&)>& look) {
  std::array<std::vector<double>, 6> found;
  for (int seed = 1; seed <= effort.seeds; ++seed) {
    const Stage stage = plan.triaxial ? triaxial_stage(plan.friction, plan.rate, plan.strain)
                                      : shear_stage(plan.friction, plan.rate, plan.strain);
    const CellRun run =
        run_cell({.grains = static_cast<std::int64_t>(effort.size * static_cast<double>(plan.grains)),
                  .seed = static_cast<std::uint64_t>(seed),
                  .stages = {press_stage(plan.friction_of_press), stage},
                  .effort = effort,
                  .slender = plan.triaxial ? 1.5 : 1});
    result.steps += run.steps;
    result.missed += run.missed;
    const double half = 0.5 * (plan.triaxial ? run.sheared.back() : plan.strain);
    const auto take = [&](std::size_t k, const std::function<double(const CellReport&)>& of) {
      found[k].push_back(mean_over(run, stage.name, half, of));
    };
    take(0, shear_ratio);
    take(1, [](const CellReport& row) { return row.q_over_p; });
    take(2, [](const CellReport& row) { return row.solid_fraction; });
    take(3, [](const CellReport& row) { return row.coordination; });
    take(4, [](const CellReport& row) { return 0.4 * (row.a_c + row.a_n + 1.5 * row.a_t); });
    take(5, [](const CellReport& row) { return row.fabric_q_over_p; });
    if (look) look(run);
  }
  return {mean_of(found[0]), mean_of(found[1]), mean_of(found[2]),
          mean_of(found[3]), mean_of(found[4]), mean_of(found[5])};
}

io::Chart chart_of(const std::string& name, const std::string& title, const std::string& x,
                   const std::string& y) {
  return {
      .name = name, .title = title, .subtitle = "means over seeds", .x_label = x, .y_label = y, .series = {}};
}

}  // namespace talus::literature
