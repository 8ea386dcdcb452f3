#include "apps/commands/run_status.hpp"

#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/files/output_directory.hpp"
#include "io/results/run_json.hpp"
#include "runtime/graph/clock.hpp"

namespace talus {

namespace {

constexpr double interval = 1;  // [s]

double since_1970() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

void write(const std::filesystem::path& path, nlohmann::ordered_json status) {
  status["pid"] = ::getpid();
  status["host"] = io::host_name();
  status["heartbeat"] = since_1970();
  try {
    io::write_whole(path,
                    status.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n');
  } catch (const std::exception&) {
    // The next one may do better; the run has its own files to worry about.
  }
}

}  // namespace

StatusFile::StatusFile(const std::filesystem::path& directory) : path_(directory / "status.json") {}

void StatusFile::begin() const {
  write(path_, {{"stage", "the sample is made"}, {"step", 0}});
}

void StatusFile::update(const Simulation& simulation, const Tally& tally, const CheckpointKeeper& keeper,
                        double now, bool last) {
  const StepReport& report = simulation.report();
  const double fraction = simulation.stage_fraction();
  if (!first_step_) {
    first_step_ = report.step;
    first_time_ = now;
  }
  if (stage_ != simulation.stage().name) {
    stage_ = simulation.stage().name;
    stage_began_ = now;
    stage_fraction_ = fraction;
  }
  if (!last && now - written_ < interval) return;
  written_ = now;
  nlohmann::ordered_json status{{"stage", stage_},
                                {"stage_fraction", fraction},
                                {"step", report.step},
                                {"time", report.time},
                                {"missed_steps", tally.unconverged}};
  if (report.step > *first_step_)
    status["steps_per_s"] = static_cast<double>(report.step - *first_step_) / (now - first_time_);
  if (fraction > stage_fraction_)
    status["stage_eta_s"] = (now - stage_began_) * (1 - fraction) / (fraction - stage_fraction_);
  if (keeper.last_step())
    status["checkpoint"] = {{"step", *keeper.last_step()},
                            {"age_s", graph::seconds_now() - keeper.last_save()},
                            {"seconds", keeper.seconds()}};
  write(path_, std::move(status));
}

}  // namespace talus
