#include "runtime/step/probes.hpp"

#include <algorithm>
#include <stdexcept>

#include "kernels/shapes/region_parts.hpp"
#include "runtime/step/due_clock.hpp"
#include "runtime/step/probe_contents.hpp"

namespace talus {

Probes::Probes(const Setup& setup)
    : setup_(setup), materials_(std::max<std::size_t>(1, setup.material_names.size())) {
  const std::size_t p = setup.probes.size();
  for (const ProbeRule& rule : setup.probes) any_surface_ |= rule.region.is_surface();
  now_.count.assign(p * materials_, 0);
  now_.mass.assign(p * materials_, 0);
  now_.count_told.assign(p, 0);
  now_.mass_told.assign(p, 0);
  now_.time_told.assign(p, 0);
  now_.passed.assign(p, 0);
}

void Probes::go_on_from(const ProbeState& state) {
  if (state.count.size() != now_.count.size() || state.mass.size() != now_.mass.size() ||
      state.count_told.size() != now_.count_told.size() || state.mass_told.size() != now_.mass_told.size() ||
      state.time_told.size() != now_.time_told.size() || state.passed.size() != now_.passed.size())
    throw std::invalid_argument("the checkpoint has other probes than the scene");
  now_ = state;
}

void Probes::begin_step(const StepState& state) {
  if (any_surface_) passages_.begin_step(state);
}

bool Probes::is_due(std::size_t probe, const ProbedStep& step) {
  const ProbeRule& rule = setup_.probes[probe];
  DueClock clock(rule.every_steps, rule.every, now_.passed[probe]);
  const bool due = clock.due(step.step, step.time);
  now_.passed[probe] = clock.passed();
  return due;
}

void Probes::end_step(const ProbedStep& step, const StepState& state, const graph::Communicator& ranks) {
  reports_.clear();
  if (setup_.probes.empty()) return;
  if (any_surface_)
    for (const Passage& passage : passages_.end_step(setup_.probes, state, step.dealt, ranks)) {
      const std::size_t at =
          static_cast<std::size_t>(passage.probe) * materials_ + static_cast<std::size_t>(passage.material);
      now_.count[at] += passage.way;
      now_.mass[at] += static_cast<double>(passage.way) * passage.mass;
    }
  std::vector<std::size_t> due;
  for (std::size_t p = 0; p < setup_.probes.size(); ++p)
    if (is_due(p, step)) due.push_back(p);
  if (due.empty()) return;
  for (const std::size_t p : due) {
    ProbeReport& report = reports_.emplace_back();
    report.name = setup_.probes[p].name;
    report.materials.resize(materials_);
    if (setup_.probes[p].region.is_surface()) report_passages(p, step.time, report);
  }
  report_contents(due, step, state, ranks);
}

/// Passages so far, and their rates since the last report.
void Probes::report_passages(std::size_t probe, double time, ProbeReport& report) {
  for (std::size_t m = 0; m < materials_; ++m) {
    report.materials[m].passed_count = now_.count[probe * materials_ + m];
    report.materials[m].passed_mass = now_.mass[probe * materials_ + m];
    report.passed_count += report.materials[m].passed_count;
    report.passed_mass += report.materials[m].passed_mass;
  }
  const double since = time - now_.time_told[probe];
  report.count_rate = static_cast<double>(report.passed_count - now_.count_told[probe]) / since;
  report.mass_rate = (report.passed_mass - now_.mass_told[probe]) / since;
  now_.count_told[probe] = report.passed_count;
  now_.mass_told[probe] = report.passed_mass;
  now_.time_told[probe] = time;
}

void Probes::report_contents(const std::vector<std::size_t>& due, const ProbedStep& step,
                             const StepState& state, const graph::Communicator& ranks) {
  std::vector<Region> regions;
  std::vector<ProbeReport*> reports;
  for (std::size_t k = 0; k < due.size(); ++k)
    if (const Region& region = setup_.probes[due[k]].region; !region.is_surface()) {
      regions.push_back(region);
      reports.push_back(&reports_[k]);
    }
  if (regions.empty()) return;
  const std::vector<RegionSums> sums = sum_over_regions(regions, materials_, state, ranks);
  for (std::size_t k = 0; k < sums.size(); ++k) {
    ProbeReport& report = *reports[k];
    const RegionSums& sum = sums[k];
    report.count = sum.motion.count;
    report.mass = sum.motion.mass;
    report.velocity = sum.motion.mean;
    report.temperature = sum.motion.temperature();
    if (report.count > 0)
      report.coordination = static_cast<double>(sum.ends) / static_cast<double>(report.count);
    for (std::size_t m = 0; m < materials_; ++m) {
      report.materials[m].count = sum.counts[m];
      report.materials[m].mass = sum.masses[m];
    }
    const double volume = volume_of(regions[k]);
    if (volume == 0) continue;
    report.solid_fraction = sum.volume / volume;
    report.contact_stress = sum.moment / (volume * step.impulse_time);
    report.kinetic_stress = sum.motion.spread / volume;
  }
}

}  // namespace talus
