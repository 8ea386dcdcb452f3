// The recorder and the sinks that it drives.

#include "io/output/recorder.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"
#include "io/output/thinned_curve.hpp"
#include "io/results/csv_writer.hpp"
#include "io/results/results.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io {
namespace {

namespace fs = std::filesystem;
using namespace talus::test;

Recorder opened(const fs::path& directory, const std::set<std::string>& sinks) {
  Recorder recorder(output_context(directory, setup_with_two_walls()), sinks);
  recorder.open();
  return recorder;
}

std::set<std::string> every_sink() {
  const std::vector<std::string> names = sink_registry().names();
  return {names.begin(), names.end()};
}

TEST(Recorder, EveryFileOfEverySinkIsKnownToForce) {
  const ScratchDirectory scratch;
  Recorder recorder = opened(scratch.path(), every_sink());
  recorder.record_step({.triaxial = triaxial_row(1, "shear"), .errors = std::vector<ErrorCheck>(1)});
  recorder.record_frame(three_grains());
  recorder.close();
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(scratch.path())) {
    if (entry.is_directory()) continue;
    EXPECT_TRUE(is_output_name(entry.path().lexically_relative(scratch.path()).generic_string()))
        << entry.path();
    ++files;
  }
  EXPECT_GE(files, 12u);
}

TEST(Recorder, LeavesTheStateOfARunThatIsGoingOn) {
  const ScratchDirectory scratch;
  const Recorder recorder = opened(scratch.path(), default_sinks());
  EXPECT_EQ(nlohmann::json::parse(content_of(scratch / "run.json"))["summary"]["status"], "running");
  EXPECT_EQ(content_of(scratch / "steps.csv"), steps_csv_header());
  EXPECT_FALSE(fs::exists(scratch / "triaxial.csv")) << "a scene without a triaxial stage has no such table";
}

TEST(Recorder, WritesWhatItWasGiven) {
  const ScratchDirectory scratch;
  Recorder recorder = opened(scratch.path(), default_sinks());
  for (int k = 1; k <= 3; ++k) {
    const Frame frame = three_grains();
    recorder.record_step({.step = {.step = k}, .walls = frame.walls, .triaxial = triaxial_row(k, "shear")});
    if (k != 2) recorder.record_frame(three_grains());
  }
  recorder.close();
  EXPECT_EQ(occurrences(content_of(scratch / "steps.csv"), "\n"), 1u + 3u);
  EXPECT_EQ(occurrences(content_of(scratch / "walls.csv"), "\n"), 1u + 3u * 2u);
  EXPECT_EQ(occurrences(content_of(scratch / "triaxial.csv"), "\n"), 1u + 3u);
  EXPECT_EQ(frame_count(scratch / "results.h5"), 2u);
  const std::string collection = content_of(scratch / "fields.pvd");
  for (const char* name :
       {"fields/grains_000001.vtp", "fields/forces_000001.vtp", "fields/walls_000001.vtp"}) {
    EXPECT_EQ(occurrences(collection, name), 1u);
    EXPECT_TRUE(fs::exists(scratch / name)) << name;
  }
  EXPECT_EQ(recorder.frames(), 2u);
}

TEST(Recorder, HandsOverAllLinesSoFarWhenAsked) {
  const ScratchDirectory scratch;
  Recorder recorder = opened(scratch.path(), default_sinks());
  const Frame frame = three_grains();
  for (int k = 1; k <= 3; ++k) {
    recorder.record_step({.step = {.step = k},
                          .walls = frame.walls,
                          .triaxial = triaxial_row(k, "shear"),
                          .errors = std::vector<ErrorCheck>(2)});
  }
  recorder.flush();
  EXPECT_EQ(occurrences(content_of(scratch / "steps.csv"), "\n"), 1u + 3u);
  EXPECT_EQ(occurrences(content_of(scratch / "walls.csv"), "\n"), 1u + 3u * 2u);
  EXPECT_EQ(occurrences(content_of(scratch / "triaxial.csv"), "\n"), 1u + 3u);
  EXPECT_EQ(occurrences(content_of(scratch / "error_history.csv"), "\n"), 1u + 3u * 2u);
}

TEST(Recorder, WritesNothingThatWasNotAskedFor) {
  const ScratchDirectory scratch;
  OutputContext context = output_context(scratch.path(), setup_with_two_walls());
  context.contacts = false;
  Recorder recorder(std::move(context), {});
  recorder.open();
  recorder.record_frame(three_grains());
  recorder.close();
  EXPECT_TRUE(read_frame(scratch / "results.h5", 0).contact_bodies.empty());
  for (const char* name : {"fields", "fields.pvd", "forces.svg", "triaxial.svg"}) {
    EXPECT_FALSE(fs::exists(scratch / name)) << name;
  }
}

TEST(Recorder, DrawsStressAndStrainOnlyWhereTheSampleIsStrained) {
  for (const double strain : {0.0, -0.01}) {
    const ScratchDirectory scratch;
    Recorder recorder = opened(scratch.path(), default_sinks());
    TriaxialReport row = triaxial_row(1, "shear");
    row.strain[2] = strain;
    recorder.record_step({.step = {.step = 1}, .walls = three_grains().walls, .triaxial = row});
    recorder.close();
    EXPECT_EQ(fs::exists(scratch / "triaxial.svg"), strain != 0) << "a box of fixed walls has no curve";
  }
}

TEST(Recorder, SaysHowTheRunEndedEvenWhereItsFilesNeverOpened) {
  const ScratchDirectory scratch;
  Recorder recorder(output_context(scratch.path(), setup_with_two_walls()), default_sinks());
  Summary summary;
  summary.message = "disk full";
  recorder.end(summary);
  EXPECT_EQ(nlohmann::json::parse(content_of(scratch / "run.json"))["summary"]["message"], "disk full");
}

TEST(Sinks, ThatScenesMaySwitchAreTheOnesThatAreNotAlwaysWritten) {
  for (const auto& sink : sink_registry())
    EXPECT_EQ(default_sinks().contains(std::string(sink.name)), sink.make->use == SinkUse::by_default)
        << sink.name;
  EXPECT_EQ(default_sinks(), (std::set<std::string>{"fields", "pictures"}));
}

TEST(ThinnedCurve, StaysSmallEvenAndEndsWithTheNewestRow) {
  ThinnedCurve curve(100);
  for (int k = 0; k < 12345; ++k) curve.add(triaxial_row(k, "shear"));
  const auto rows = curve.rows();
  ASSERT_GE(rows.size(), 100u);
  EXPECT_LE(rows.size(), 201u);
  EXPECT_EQ(rows.front().step, 0);
  EXPECT_EQ(rows.back().step, 12344);
  const std::int64_t stride = rows[1].step - rows[0].step;
  for (std::size_t k = 1; k + 1 < rows.size(); ++k) EXPECT_EQ(rows[k].step - rows[k - 1].step, stride);
  curve.add(triaxial_row(12345, "next"));
  EXPECT_EQ(curve.rows().size(), 1u);
}

}  // namespace
}  // namespace talus::io
