#include "io/scene/detail/solver_keys.hpp"

#include <string>
#include <vector>

#include "io/scene/detail/spelling.hpp"
#include "partition/partitioners.hpp"
#include "runtime/step/methods/method.hpp"

namespace talus::io::detail {

Section<DetectionSettings> detection_keys() {
  return {"[detection]",
          "",
          {
              key<DetectionSettings>("alert", "m", positive,
                                     "A pair with a smaller gap is a contact of the step.",
                                     &DetectionSettings::alert)
                  .or_auto(0, "a tenth of the smallest radius"),
              key<DetectionSettings>("skin", "m", not_negative,
                                     "Margin beyond `alert` within which pairs are remembered as candidates.",
                                     &DetectionSettings::skin)
                  .or_auto(-1, "a fifth of the smallest radius"),
          }};
}

Section<SolverSettings> solver_keys() {
  return {
      "[solver]",
      "When a step counts as solved, and how hard to try. Neither clumps nor rolling resistance "
      "go with `nlgs+momentum` or `nncg`, nor with one another; a cell that follows a stress goes with no "
      "`overlap_correction`.",
      {
          choice<SolverSettings>("method", methods(), &SolverSettings::method),
          key<SolverSettings>("tolerance", "", positive,
                              "Bound on the relative error of the contact law (error_rms).",
                              &SolverSettings::tolerance),
          key<SolverSettings>("max_tolerance", "", positive,
                              "Bound on the error of the worst contact (error_max).",
                              &SolverSettings::max_tolerance)
              .or_auto(0, "a hundred times `tolerance`"),
          key<SolverSettings>("quantile_tolerance", "", positive,
                              "Bound on the error that a share `quantile` of the contacts does not exceed "
                              "(error_quantile).",
                              &SolverSettings::quantile_tolerance)
              .blank_when_zero()
              .or_else("not asked for"),
          key<SolverSettings>("quantile", "", {.low = 0.001, .high = 1}, "That share.",
                              &SolverSettings::quantile)
              .only("quantile_tolerance is given",
                    [](const SolverSettings& s) { return s.quantile_tolerance > 0; }),
          key<SolverSettings>(
              "balance_tolerance", "", positive,
              "Bound on the estimated error of the forces and on the momentum defect (balance).",
              &SolverSettings::balance_tolerance),
          key<SolverSettings>(
              "velocity_tolerance", "", positive,
              "Bound on the estimated error of the velocities in clusters of contacts that are "
              "too large for a direct solve, over what these exchange (velocity_error; with friction it may "
              "tell "
              "more, unless this is set).",
              &SolverSettings::velocity_tolerance)
              .or_auto(0,
                       "`balance_tolerance`; in stages with friction ten times that, but at most 1 unless it "
                       "is more itself"),
          key<SolverSettings>("direct_bodies", "", {.low = 0, .high = 5000},
                              "Clusters of contacts with more bodies are judged by estimates alone. Of what "
                              "this allows, those of up to 200 bodies (500 without friction, long chains "
                              "5000) are solved directly before a step ends, which takes up to a thousand "
                              "times as long as their sweeps. 0: none is.",
                              &SolverSettings::direct_bodies),
          key<SolverSettings>(
              "overlap_tolerance", "", positive,
              "Bound on what two bodies, or a body and a wall, end a step in by, over the smaller radius and "
              "beyond what the sample began with (overlap).",
              &SolverSettings::overlap_tolerance),
          key<SolverSettings>("max_iterations", "", countable, "Sweeps per step, at most.",
                              &SolverSettings::max_iterations),
          key<SolverSettings>("check_every", "", {.low = 2, .high = countable.high},
                              "Sweeps between the first checks of the error; later checks are rarer.",
                              &SolverSettings::check_every),
          key<SolverSettings>("warm_start", "", any, "Begin from the impulses of the last step.",
                              &SolverSettings::warm_start),
          key<SolverSettings>(
              "overlap_correction", "", {.low = 0, .high = 1},
              "Part of an overlap that a step undoes. 0: overlaps stay, and what the tolerance "
              "leaves adds up over many steps; 0.1 keeps long quasi-static runs tight.",
              &SolverSettings::overlap_correction),
          choice<SolverSettings>(
              "restitution_law", {"moreau", "newton"},
              "What `restitution` means. `moreau`: what sticks rebounds along the contact, "
              "too, with the largest restitution of the stage; contacts create no energy. "
              "`newton`: what sticks stops; impacts of many grains with friction may "
              "create energy.",
              &SolverSettings::restitution_law),
          choice<SolverSettings>(
              "precision", {"mixed", "double"},
              "Numbers of the sweeps. `mixed`: single precision with momentum, on more "
              "than 1000 candidates, until the error is 1e-5; what is judged and written is in "
              "double precision.",
              &SolverSettings::precision),
          choice<SolverSettings>("simd", {"auto", "portable", "avx2", "avx512"},
                                 "Instructions of the sweeps; `auto`: the widest that the processors of all "
                                 "ranks have. All give the same bits; `portable` is slow where the processor "
                                 "has no fused product.",
                                 &SolverSettings::simd),
      }};
}

namespace {

/// "auto, boxes or fitted": the partitioners that cut boxes.
std::string box_cutters() {
  std::vector<std::string> names;
  for (const auto& partitioner : partitioner_registry())
    if (partitioner.make->takes_boxes) names.emplace_back(partitioner.name);
  const std::string last = names.back();
  names.pop_back();
  return listed(names) + " or " + last;
}

}  // namespace

Section<DecompositionSettings> decomposition_keys() {
  using D = DecompositionSettings;
  const auto schwarz = [](const D& d) { return d.coupling == Coupling::schwarz; };
  const auto in_boxes = [](const D& d) { return cuts_boxes(d.partitioner); };
  return {
      "[decomposition]",
      "How the sample is cut into subdomains, and how these act on one another. `schwarz` goes with neither "
      "clumps, rolling resistance, `nlgs+momentum` nor `overlap_correction`; a cell that follows a stress "
      "is coupled by `nscdd`.",
      {
          key<D>("subdomains", "", {.low = 1, .high = most_subdomains},
                 "Number of subdomains, at least one per rank.", &D::subdomains)
              .blank_when_zero()
              .or_else("product of `boxes`, else one per rank"),
          choice<D>("partitioner", partitioner_registry(), &D::partitioner),
          key<D>("boxes", "", countable,
                 "Boxes along x, y and z; their product is `subdomains`, which need not be given.", &D::boxes)
              .blank_when_zero()
              .only("partitioner = " + box_cutters(), in_boxes),
          choice<D>("coupling", couplings(), &D::coupling),
          choice<D>("exchange", {"dcs", "ccs"},
                    "`dcs`: between the subdomains that share a body; `ccs`: through one rank.",
                    &D::exchange),
          choice<D>("mapping", {"block", "cyclic"},
                    "Subdomains on ranks, `block`: consecutive ones share a rank; `cyclic`: dealt out one by "
                    "one. No result depends on it.",
                    &D::mapping),
          key<D>("sweeps_per_exchange", "", countable,
                 "Sweeps between two exchanges (n_GS); `alternating` takes 1 only.", &D::sweeps_per_exchange),
          choice<D>(
              "balance", {"work", "contacts", "time"},
              "What subdomains get equal shares of. `work`: contacts, and what it takes to glue their "
              "interfaces; `time`: measured time of their sweeps, for cores of unequal speed; results then "
              "differ from run to run.",
              &D::balance),
          key<D>("repartition_every", "", countable,
                 "Steps after which space is cut anew, with the next broad phase.", &D::repartition_every),
          key<D>("max_imbalance", "", positive,
                 "Contacts of the fullest subdomain over those of the mean one, less 1, beyond which space "
                 "is cut "
                 "anew at once.",
                 &D::max_imbalance),
          key<D>("overlap", "", any, "Sweep inner chunks while messages fly; false shows what that is worth.",
                 &D::overlap),
          key<D>(
              "damping", "", any,
              "Damp contacts at the interface by multiplicity. Without, Schwarz diverges where bodies stand "
              "in more than two subdomains.",
              &D::damping)
              .only("coupling = schwarz", schwarz),
      }};
}

}  // namespace talus::io::detail
