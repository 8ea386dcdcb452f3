#include "io/results/recorder.hpp"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/pictures/picture.hpp"

namespace talus::io {
namespace {

std::vector<std::string> names_of(const std::vector<Wall>& walls) {
  std::vector<std::string> names;
  for (const Wall& wall : walls) names.push_back(wall.name);
  return names;
}

void drop_contacts(Frame& frame) {
  frame.contact_bodies.clear();
  frame.contact_point.clear();
  frame.contact_normal.clear();
  frame.contact_gap.clear();
  frame.contact_force.clear();
}

}  // namespace

void ThinnedCurve::add(const TriaxialReport& report) {
  if (newest_ && newest_->stage != report.stage) *this = ThinnedCurve(capacity_);
  newest_ = report;
  if (count_++ % stride_ != 0) return;
  kept_.push_back(report);
  if (kept_.size() < 2 * capacity_) return;
  for (std::size_t k = 0; 2 * k < kept_.size(); ++k) kept_[k] = kept_[2 * k];
  kept_.resize((kept_.size() + 1) / 2);
  stride_ *= 2;
}

std::vector<TriaxialReport> ThinnedCurve::rows() const {
  std::vector<TriaxialReport> rows = kept_;
  if (newest_ && (rows.empty() || rows.back().step != newest_->step)) rows.push_back(*newest_);
  return rows;
}

Recorder::Recorder(const std::filesystem::path& directory, const RecorderOptions& options, const Setup& setup,
                   const Provenance& provenance)
    : Recorder(directory, options, setup, provenance, graph::one_rank()) {}

Recorder::Recorder(const std::filesystem::path& directory, const RecorderOptions& options, const Setup& setup,
                   const Provenance& provenance, const graph::Communicator& ranks)
    : directory_(directory), options_(options), walls_(setup.walls), provenance_(provenance), ranks_(ranks) {
  for (const Stage& stage : setup.stages) axis_of_stage_.emplace(stage.name, stage.end.strain_axis);
  if (ranks.rank() == 0) {
    steps_.emplace(directory / "steps.csv", steps_csv_header());
    wall_rows_.emplace(directory / "walls.csv", walls_csv_header());
    if (options_.fields) {
      std::error_code error;
      std::filesystem::create_directories(directory_ / "fields", error);
      if (error) throw FileError((directory_ / "fields").string(), "cannot be created: " + error.message());
    }
    write_run_json(directory_ / "run.json", provenance_, Summary{});
  }
  if (options_.frames) results_.emplace(directory_ / "results.h5", names_of(walls_), ranks_);
}

void Recorder::record_step(const StepReport& report, std::span<const WallReport> walls,
                           const std::optional<TriaxialReport>& triaxial) {
  if (ranks_.rank() != 0) return;
  append_steps_row(steps_->pending(), report);
  for (const WallReport& wall : walls) append_walls_row(wall_rows_->pending(), report, wall);
  if (!triaxial) return;
  if (!triaxial_) triaxial_.emplace(directory_ / "triaxial.csv", triaxial_csv_header());
  append_triaxial_row(triaxial_->pending(), *triaxial);
  if (options_.pictures) curve_.add(*triaxial);
}

void Recorder::record_errors(std::int64_t step, std::span<const Iteration::Check> checks) {
  if (checks.empty() || ranks_.rank() != 0) return;
  if (!errors_) errors_.emplace(directory_ / "error_history.csv", error_history_csv_header());
  for (const Iteration::Check& check : checks) append_error_history_row(errors_->pending(), step, check);
}

void Recorder::flush() {
  for (std::optional<CsvFile>* table : {&steps_, &wall_rows_, &triaxial_, &errors_})
    if (*table) (*table)->flush();
}

void Recorder::record_frame(Frame&& frame) {
  const Frame state = [&] {
    Frame taken = std::move(frame);
    if (!options_.contacts) drop_contacts(taken);
    return taken;
  }();
  validate(state);
  if (results_) results_->append(state);
  if (options_.fields) write_fields(state);
  if (options_.pictures && options_.contacts) draw_force_picture(state);
  draw_triaxial_picture();
  ++frames_;
}

void Recorder::close() {
  if (ranks_.rank() != 0) return;
  steps_->close();
  wall_rows_->close();
  if (triaxial_) triaxial_->close();
  if (errors_) errors_->close();
  draw_triaxial_picture();
}

void Recorder::write_fields(const Frame& frame) {
  // Made of the parts of all ranks; rank 0 writes.
  const auto write = [&](const std::string& name, const auto& make) {
    if (ranks_.rank() == 0)
      write_whole(directory_ / "fields" / name, make);
    else
      make([](std::string_view) {});
  };
  const auto collect = [&](const char* name, const std::vector<FieldFile>& files) {
    if (ranks_.rank() == 0) write_whole(directory_ / name, collection_pvd(files));
  };
  const std::string grains = fmt::format("grains_{:06}.vtp", frames_);
  write(grains, [&](const WriteText& out) { write_grains_vtp(frame, ranks_, out); });
  grain_files_.push_back({frame.time, 0, grains});
  collect("fields/grains.pvd", grain_files_);
  if (options_.contacts) {
    const std::string forces = fmt::format("forces_{:06}.vtp", frames_);
    write(forces, [&](const WriteText& out) { write_forces_vtp(frame, ranks_, out); });
    force_files_.push_back({frame.time, 0, forces});
    collect("fields/forces.pvd", force_files_);
  }
  std::vector<FieldFile> all;
  for (const FieldFile& file : grain_files_) all.push_back({file.time, 0, "fields/" + file.path});
  for (const FieldFile& file : force_files_) all.push_back({file.time, 1, "fields/" + file.path});
  collect("fields.pvd", all);
}

void Recorder::draw_force_picture(const Frame& part) const {
  const ForcePicture options;
  if (ranks_.ranks() == 1) {
    write_whole(directory_ / "forces.svg", draw_forces(part, walls_, options));
    return;
  }
  const Frame all = gather_for_picture(part, ranks_, options);
  if (ranks_.rank() == 0) write_whole(directory_ / "forces.svg", draw_forces(all, walls_, options));
}

void Recorder::draw_triaxial_picture() const {
  if (!options_.pictures || curve_.empty()) return;
  const std::vector<TriaxialReport> rows = curve_.rows();
  TriaxialPicture picture;
  picture.stage = rows.back().stage;
  if (const auto found = axis_of_stage_.find(picture.stage); found != axis_of_stage_.end())
    picture.axis = found->second;
  write_whole(directory_ / "triaxial.svg", draw_triaxial(rows, picture));
}

}  // namespace talus::io
