#pragma once

/// Rows of a scaling study and the arithmetic on them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace talus {

/// Where the figures of a row come from.
enum class ScalingSource {
  run,     ///< measured on this machine
  replay,  ///< predicted from a recorded trace
  smpi,    ///< predicted: the program itself on simulated ranks
};
const char* name_of(ScalingSource source);

enum class ScalingKind {
  strong,  ///< one sample on more and more cores
  weak,    ///< as many grains a core
  hybrid,  ///< one sample on as many cores, divided into ranks and threads in all ways
};
const char* name_of(ScalingKind kind);

/// One machine. Times and iterations are means over the steps of the study.
struct ScalingRow {
  ScalingKind kind = ScalingKind::strong;
  ScalingSource source = ScalingSource::run;
  std::string variant;  ///< overrides of the scene, "" for none
  std::string network;  ///< that messages were predicted with; "" for runs
  int subdomains = 1, ranks = 1, threads = 1;
  std::size_t grains = 0;
  double contacts = 0;
  int repeats = 1;
  double seconds = 0, fastest = 0, slowest = 0;  ///< of a step: median of the repeats, and their range [s]
  double iterations = 0;                         ///< of a step
  std::int64_t missed = 0;  ///< steps over tolerance, of those that count, in the worst of the repeats

  static constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  double speedup = nan;        ///< over one core, per grain
  double efficiency = nan;     ///< speedup / cores = of_iterations x of_sweeps
  double of_iterations = nan;  ///< iterations on one core over those here
  double of_sweeps = nan;      ///< time of an iteration on one core over cores x that here, per grain

  /// Of replay alone: of_sweeps = work x balance x communication x within. The last three are those of
  /// trace::Efficiencies.
  double work = nan;  ///< work of an iteration on one core over that of all cores here, per grain
  double balance = nan, communication = nan, within = nan;
  double exposed = nan;  ///< waited for messages, part of all threads' time
  std::array<double, 5>
      share{};       ///< partitioning, detection, inloop 1, inloop 2, update: of all threads' time
  std::string path;  ///< what the critical path was made of

  bool predicted() const { return source != ScalingSource::run; }
  int cores() const { return ranks * threads; }
};

/// Fills in what is relative to one core. A row is held against that of its kind (hybrid: strong), source and
/// network on one rank with one thread and one subdomain: that of its own variant, or else the one without
/// variant. Rows without such a row keep NaN.
void relate(std::vector<ScalingRow>& rows);

/// Beyond these figures cannot be right. Ratios have no unit.
struct DoubtThresholds {
  double efficiency = 1.3;  ///< of a row, > 1: caches of more cores give some
  double one_core = 1.3;    ///< time predicted for one core over the measured one, or the inverse, > 1
};

/// What says that times are not comparable: a sentence for the highest efficiency that no machine has, and
/// one for a prediction of one core that its measurement refutes. Empty where there is nothing. `rows`:
/// related.
std::vector<std::string> doubts_about(const std::vector<ScalingRow>& rows,
                                      const DoubtThresholds& thresholds = {});

/// The factor that costs most, with its value: "more iterations (0.93)"; "" when nothing is known, "nothing"
/// when all factors are above 0.995.
std::string bound_of(const ScalingRow& row);

}  // namespace talus
