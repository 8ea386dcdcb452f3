// The directory of a run, its tables, run.json and the progress line.

#include <gtest/gtest.h>

#include <bit>
#include <nlohmann/json.hpp>

#include "io/files/crc.hpp"
#include "io/files/error.hpp"
#include "io/output/sinks.hpp"
#include "io/results/csv_writer.hpp"
#include "io/results/progress.hpp"
#include "io/results/run_json.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io {
namespace {

namespace fs = std::filesystem;
using namespace talus::test;

TEST(Csv, HeadersAreThosePromised) {
  EXPECT_EQ(steps_csv_header(),
            "step,time,time_step,candidates,contacts,active,iterations,error_rms,error_max,error_quantile,"
            "worst_contact_body,worst_contact_with,worst_body,worst_body_error,balance,velocity_error,jump,"
            "penetration_mean,penetration_max,overlap,overlap_body,overlap_with,kinetic_translation,"
            "kinetic_rotation,solid_fraction,equilibrium,migrants,imbalance,wall_s,converged\n");
  EXPECT_EQ(walls_csv_header(),
            "step,time,wall,position,velocity,force_x,force_y,force_z,torque_x,torque_y,"
            "torque_z,work\n");
  EXPECT_EQ(triaxial_csv_header(),
            "step,time,stage,strain_x,strain_y,strain_z,strain_volume,strain_shear,solid_fraction,stress_x,"
            "stress_y,"
            "stress_z,p,q,q_over_p,coordination,converged\n");
}

TEST(Csv, StepsRowHoldsEveryValueInItsColumn) {
  StepReport r{1,   2.5,  0.25, 3,    4,    5,    6,  7.5,  8.5,  8.75, {0.5, {2, 9}, 0.625, 3},
               9.5, 9.75, 10.5, 11.5, 12.5, 0.75, {}, 13.5, 14.5, 15.5, 19.5,
               16,  17.5, 18.5, true};
  std::string row;
  append_steps_row(row, r);
  EXPECT_EQ(
      row,
      "1,2.5,0.25,3,4,5,6,7.5,8.5,8.75,2,9,3,0.625,9.5,9.75,10.5,11.5,12.5,0.75,-1,-1,13.5,14.5,15.5,19.5,"
      "16,17.5,18.5,1\n");
  r.overlapping = {7, -2};
  row.clear();
  append_steps_row(row, r);
  EXPECT_NE(row.find(",0.75,7,-2,13.5,"), std::string::npos) << row;
}

TEST(Csv, TriaxialAndWallRowsHoldEveryValueInItsColumn) {
  std::string row;
  append_triaxial_row(
      row,
      TriaxialReport{
          1, 2.5, "s", {3.5, 4.5, 5.5}, 6.5, 7.5, 8.5, {9.5, 10.5, 11.5}, 12.5, 13.5, 14.5, 15.5, false});
  EXPECT_EQ(row, "1,2.5,s,3.5,4.5,5.5,6.5,7.5,8.5,9.5,10.5,11.5,12.5,13.5,14.5,15.5,0\n");
  row.clear();
  append_walls_row(row, StepReport{.step = 3, .time = 0.5},
                   WallReport{"top", 1.5, -2.5, Vec3(3.5, 4.5, 5.5), Vec3(6.5, 7.5, 8.5), 9.5});
  EXPECT_EQ(row, "3,0.5,top,1.5,-2.5,3.5,4.5,5.5,6.5,7.5,8.5,9.5\n");
}

TEST(Csv, NumbersReadBackBitForBit) {
  for (const double value :
       {1.0 / 3, 0.1, -0.0, 5e-324, 1.7976931348623157e308, 6.02214076e23, 1e-5, 123456789.123}) {
    std::string row;
    append_walls_row(row, StepReport{.time = value}, WallReport{});
    const double back = std::strtod(split(row, ',').at(1).c_str(), nullptr);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(back), std::bit_cast<std::uint64_t>(value)) << row;
  }
}

TEST(Csv, NamesWithCommasAndQuotesAreQuoted) {
  std::string row;
  append_walls_row(row, StepReport{}, WallReport{"top, \"left\""});
  EXPECT_EQ(row, "0,0,\"top, \"\"left\"\"\",0,0,0,0,0,0,0,0,0\n");
}

TEST(Csv, AFullDiskIsAnErrorThatNamesTheFile) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "needs /dev/full";
  const std::string message = message_of<FileError>([] { CsvFile("/dev/full", steps_csv_header()); });
  EXPECT_NE(message.find("/dev/full"), std::string::npos) << message;
  EXPECT_NE(message.find("No space left"), std::string::npos) << message;
}

TEST(Csv, OnDiskAreWholeLinesAtAnyMoment) {
  const ScratchDirectory scratch;
  CsvFile file(scratch / "steps.csv", steps_csv_header());
  EXPECT_EQ(content_of(scratch / "steps.csv"), steps_csv_header());
  for (int k = 0; k < 5000; ++k) {
    append_steps_row(file.pending(), StepReport{.step = k, .time = k / 3.0});
    if (k % 500 != 0) continue;
    file.flush();
    EXPECT_EQ(content_of(scratch / "steps.csv").back(), '\n');
    EXPECT_EQ(occurrences(content_of(scratch / "steps.csv"), "\n"), 2u + static_cast<std::size_t>(k));
  }
  file.close();
  EXPECT_EQ(occurrences(content_of(scratch / "steps.csv"), "\n"), 5001u);
}

TEST(Csv, IsMarkedByTheBytesThatStandInTheFile) {
  const ScratchDirectory scratch;
  const fs::path path = scratch / "steps.csv";
  CsvFile file(path, "step\n");
  file.pending() += "1\n2\n";
  const FileMark mark = file.sync();
  EXPECT_EQ(mark.bytes, 9);
  EXPECT_EQ(mark.crc, crc_of("step\n1\n2\n"));
  EXPECT_EQ(crc_of("123456789"), 0xcbf43926U) << "the check value of CRC-32";
  file.pending() += "3\n";
  file.close();
  EXPECT_EQ(crc_of_file(path, mark.bytes), mark.crc);
  EXPECT_NE(crc_of_file(path), mark.crc);
  CsvFile again(path, mark);
  again.pending() += "4\n";
  const FileMark end = again.sync();
  EXPECT_EQ(content_of(path), "step\n1\n2\n4\n");
  EXPECT_EQ(end.crc, crc_of_file(path));
}

// Whoever has written it: what is of another kind says nothing.
TEST(RunJson, IsReadAsFarAsItIsOne) {
  const ScratchDirectory scratch;
  const fs::path path = scratch / "run.json";
  const auto written = [&](const char* text) { std::ofstream(path) << text; };
  for (const char* text : {"", "null", "[]", "{\"provenance\": 3}", "{\"provenance\": {\"resumed\": \"x\"}}",
                           "{\"provenance\": {\"input_files\": [1, \"x\"]}}"}) {
    written(text);
    EXPECT_TRUE(resumptions_in(path).empty()) << text;
    EXPECT_TRUE(input_files_in(path).empty()) << text;
  }
  written(
      "{\"provenance\": {\"input_files\": [{\"path\": \"a.csv\", \"crc32\": \"cbf43926\"}, {\"path\": 1}], "
      "\"resumed\": [{\"ranks\": \"two\", \"step\": 7}]}}");
  ASSERT_EQ(input_files_in(path).size(), 2U);
  EXPECT_EQ(input_files_in(path)[0].path, "a.csv");
  EXPECT_EQ(input_files_in(path)[0].crc, 0xcbf43926U);
  EXPECT_EQ(resumptions_in(path).at(0).ranks, 1);
  EXPECT_EQ(resumptions_in(path).at(0).step, 7);
}

TEST(RunJson, SaysWhatWasRunAndWhatCameOfIt) {
  Provenance provenance = collect_provenance();
  provenance.command_line = {"talus", "run", "a \"b\".toml"};
  provenance.seed = 18446744073709551615u;
  provenance.threads = 2;
  Summary summary;
  summary.status = "done";
  summary.digest = 0xabc;
  summary.exit_code = 3;
  summary.worst_error_rms = 0.1;
  const auto json = nlohmann::json::parse(run_json(provenance, summary));
  EXPECT_EQ(json["provenance"]["command_line"][2], "a \"b\".toml");
  EXPECT_EQ(json["provenance"]["seed"].get<std::uint64_t>(), 18446744073709551615u);
  EXPECT_EQ(json["summary"]["digest"], "0000000000000abc");
  EXPECT_EQ(json["summary"]["exit_code"], 3);
  EXPECT_EQ(json["summary"]["worst_error_rms"].get<double>(), 0.1);
  for (const char* key : {"git_hash", "compiler", "build_type", "host", "date_utc", "version"}) {
    EXPECT_FALSE(json["provenance"][key].get<std::string>().empty()) << key;
  }
  EXPECT_GE(json["provenance"]["cores_online"], json["provenance"]["cores_allowed"]);
  EXPECT_TRUE(nlohmann::json::parse(run_json(provenance, Summary{}))["summary"]["digest"].is_null());
}

TEST(RunJson, DoesNotHideThatANumberIsNone) {
  Summary summary;
  summary.worst_penetration = 0.25;
  summary.worst_balance = std::numeric_limits<double>::quiet_NaN();
  const auto json = nlohmann::json::parse(run_json(Provenance{}, summary))["summary"];
  EXPECT_EQ(json["worst_penetration"], 0.25);
  EXPECT_TRUE(json["worst_balance"].is_null()) << json;
}

TEST(RunJson, SurvivesAFileNameThatIsNotUtf8) {
  Provenance provenance;
  provenance.scene_file = "caf\xe9.toml";
  EXPECT_TRUE(nlohmann::json::accept(run_json(provenance, Summary{})));
}

class ProgressOnAFile : public testing::Test {
 protected:
  std::string shown() {
    std::fflush(stream_);
    return content_of(scratch_ / "log");
  }
  ScratchDirectory scratch_;
  std::FILE* stream_ = std::fopen((scratch_ / "log").c_str(), "w");
  void TearDown() override { std::fclose(stream_); }
};

TEST_F(ProgressOnAFile, ShowsTheFirstTheLastAndOneEveryTenSeconds) {
  Progress progress(stream_, false, 79);
  const Progress::Clock::time_point start{};
  for (int k = 0; k <= 250; ++k) {
    progress.update(StepReport{.step = k}, "shear", k / 1000.0, start + std::chrono::milliseconds(100 * k));
  }
  progress.finish();
  const auto lines = split(shown(), '\n');
  ASSERT_EQ(lines.size(), 5u) << shown();  // at 0, 10, 20 and 25 s, and nothing after the last line end
  EXPECT_NE(lines[1].find("step 100 "), std::string::npos) << lines[1];
  EXPECT_NE(lines[3].find("step 250 "), std::string::npos) << lines[3];
  EXPECT_EQ(occurrences(shown(), "\r"), 0u);
  EXPECT_NE(lines[1].find("ETA 1:30"), std::string::npos) << lines[1];  // a tenth took 10 s
}

TEST_F(ProgressOnAFile, RewritesOneLineOnATerminalAndNeverLongerThanIt) {
  Progress progress(stream_, true, 20);
  const Progress::Clock::time_point start{};
  for (int k = 0; k <= 100; ++k) {
    progress.update(StepReport{.step = k}, "a stage of a long name", 0.5,
                    start + std::chrono::milliseconds(10 * k));
  }
  progress.finish();
  EXPECT_EQ(occurrences(shown(), "\r"), 6u);  // at 0, 0.2, ... 1 s
  EXPECT_EQ(occurrences(shown(), "\n"), 1u);
  EXPECT_EQ(split(shown(), '\r').at(1), "a stage of a long na\x1b[K");
}

TEST(ProgressLine, MarksAStepThatMissedItsTolerance) {
  const StepReport report{
      .step = 1234, .time = 0.0123, .contacts = 6012, .iterations = 45, .error_rms = 8.2e-4};
  EXPECT_EQ(progress_line(report, "shear", 0.999, 3700),
            "shear  99 %  step 1234  t 12.3 ms  6012 contacts  45 it  err 8.2e-04 MISSED  ETA 1:01:40");
}

}  // namespace
}  // namespace talus::io
