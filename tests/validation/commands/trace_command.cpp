/// Traces of the command: what is recorded, shown, played again; and what is refused.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "io/trace/trace_file.hpp"
#include "runtime/trace/timeline.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::test {
namespace {

/// Rank 0's calls of all ranks, number and bytes, by step and task; those between steps are of the task "".
using CallsOfTasks = std::map<std::pair<std::uint32_t, std::string>, std::pair<int, double>>;
CallsOfTasks calls_of_first(const trace::Trace& trace) {
  CallsOfTasks all;
  const auto add = [&](std::uint32_t step, const std::string& task, const trace::Calls& calls) {
    if (calls.count > 0) all[{step, task}] = {calls.count, calls.bytes};
  };
  const trace::Timeline timeline(trace);
  for (const std::uint32_t step : timeline.steps()) {
    const trace::StepIndex::Rank first = timeline.index(step).ranks[0];
    add(step, "", first.calls_outside);
    for (std::size_t i = 0; i < first.calls.size(); ++i) add(step, trace.tasks[0][i].name, first.calls[i]);
  }
  return all;
}

class TraceCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("talus_trace_command_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    write(folder_ / "scene.toml", pressed_box);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome talus(const std::string& arguments, const std::string& before = "") const {
    return run(folder_, arguments, before);
  }
  /// A trace of a few steps with four subdomains.
  std::string recorded(const std::string& out, int threads, const std::string& more = "") const {
    const Outcome outcome =
        talus(fmt::format("run scene.toml --out {} --threads {} --steps 5 --trace --set "
                          "decomposition.subdomains=4 {}",
                          out, threads, more));
    EXPECT_TRUE(outcome.code == 0 || outcome.code == 3) << outcome.messages;
    return out + "/trace.h5";
  }
  /// The number behind a name in what `talus replay` prints, and whether it is called predicted.
  static bool predicted(const std::string& output, const std::string& name) {
    const std::size_t at = output.find(name);
    EXPECT_NE(at, std::string::npos) << output;
    return output.substr(at, output.find('\n', at) - at).find("predicted") != std::string::npos;
  }
  fs::path folder_;
};

TEST_F(TraceCommand, AFolderIsAnsweredWithTheTraceInIt) {
  fs::create_directories(folder_ / "bare");
  const Outcome bare = talus("trace show bare");
  EXPECT_EQ(bare.code, 2);
  EXPECT_NE(bare.messages.find("is a folder without a trace.h5"), std::string::npos) << bare.messages;
  write(folder_ / "bare/trace.h5", "");
  const Outcome full = talus("trace show bare");
  EXPECT_NE(full.messages.find("its trace is bare/trace.h5"), std::string::npos) << full.messages;
  for (const Outcome* each : {&bare, &full}) EXPECT_EQ(each->messages.find("errno"), std::string::npos);
}

TEST_F(TraceCommand, ShowsAndReplaysStepsInWhichNothingTouches) {
  write(folder_ / "falling.toml", R"(time_step = 1e-3
gravity = [0, 0, -9.81]
[material]
density = 2600
[sample]
kind = "body"
name = "b"
radius = 0.01
position = [0, 0, 0.015]
[[wall]]
name = "z-"
position = 0
[[stage]]
end = { steps = 40 }
[decomposition]
subdomains = 5
)");
  ASSERT_EQ(talus("run falling.toml --out falling --trace").code, 0);
  const Table steps = read_table(folder_ / "falling/steps.csv");
  ASSERT_EQ(steps.number(0, "contacts"), 0);
  ASSERT_GT(steps.number(steps.rows.size() - 1, "contacts"), 0);
  const Outcome show = talus("trace show falling/trace.h5");
  EXPECT_EQ(show.code, 0) << show.messages;
  for (const char* ranks : {"1", "5"}) {
    const Outcome replay = talus(fmt::format("replay falling/trace.h5 --ranks {}", ranks));
    EXPECT_EQ(replay.code, 0) << replay.messages;
  }
}

TEST_F(TraceCommand, RecordsShowsExportsAndReplays) {
  const std::string trace = recorded("out", 2);
  const Outcome show = talus("trace show " + trace);
  ASSERT_EQ(show.code, 0) << show.messages;
  for (const char* word :
       {"partitioning", "contact detection", "inloop 1", "inloop 2", "update", "exposed messages",
        "load imbalance", "critical path", "task lengths", "\n  sweep ", "efficiency"})
    EXPECT_NE(show.output.find(word), std::string::npos) << word << " is missing in\n" << show.output;
  for (const char* format : {"perfetto", "paje", "svg"}) {
    const Outcome exported =
        talus(fmt::format("trace export {} --format {} --step 3 -o picture.{}", trace, format, format));
    EXPECT_EQ(exported.code, 0) << exported.messages;
    EXPECT_GT(fs::file_size(folder_ / (std::string("picture.") + format)), 1000u);
  }
  const Outcome same = talus("replay " + trace);
  ASSERT_EQ(same.code, 0) << same.messages;
  EXPECT_FALSE(predicted(same.output, "makespan"));
  const Outcome other = talus("replay " + trace + " --ranks 4 --threads 1 -o other.h5");
  ASSERT_EQ(other.code, 0) << other.messages;
  EXPECT_TRUE(predicted(other.output, "makespan"));
  EXPECT_TRUE(predicted(other.output, "bound: longest chain"));
  EXPECT_EQ(talus("trace show other.h5").output.find("recorded:"), std::string::npos);
}

TEST_F(TraceCommand, RecordingChangesNoBit) {
  recorded("with", 2);
  const Outcome without =
      talus("run scene.toml --out without --threads 2 --steps 5 --set decomposition.subdomains=4");
  EXPECT_EQ(summary(folder_ / "with")["digest"], summary(folder_ / "without")["digest"]) << without.messages;
  EXPECT_FALSE(fs::exists(folder_ / "without" / "trace.h5"));
}

TEST_F(TraceCommand, ARunFollowsARecordedOrderToTheSameBits) {
  const std::string trace = recorded("out", 3);
  const Outcome again = talus(
      "run scene.toml --out again --threads 3 --steps 5 --trace --set decomposition.subdomains=4 "
      "--replay-order " +
      trace);
  ASSERT_TRUE(again.code == 0 || again.code == 3) << again.messages;
  EXPECT_EQ(summary(folder_ / "again")["digest"], summary(folder_ / "out")["digest"]);
  const Outcome alike =
      talus("run scene.toml --out alike --steps 5 --trace --set decomposition.subdomains=4 --replay-order " +
            trace);
  ASSERT_EQ(alike.code, again.code) << "on as many threads as the recorded one: " << alike.messages;
  EXPECT_EQ(summary(folder_ / "alike")["digest"], summary(folder_ / "out")["digest"]);
  const Outcome threads = talus("run scene.toml --out other --threads 2 --replay-order " + trace);
  EXPECT_EQ(threads.code, 2) << threads.messages;
  const Outcome scene = talus("run scene.toml --out third --threads 3 --replay-order " + trace);
  EXPECT_EQ(scene.code, 1) << scene.messages;  // noticed when the loop is planned
  EXPECT_NE(scene.messages.find("another loop than the recorded one"), std::string::npos) << scene.messages;
}

TEST_F(TraceCommand, RanksWriteOneFile) {
  const std::string mpirun =
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe --bind-to none -n 3";
  const Outcome outcome = talus(
      "run scene.toml --out ranks --threads 1 --steps 3 --trace --set decomposition.subdomains=4", mpirun);
  ASSERT_TRUE(outcome.code == 0 || outcome.code == 3) << outcome.messages;
  EXPECT_FALSE(fs::exists(folder_ / "ranks" / "trace_rank_000001.h5"));
  const Outcome show = talus("trace show ranks/trace.h5");
  ASSERT_EQ(show.code, 0) << show.messages;
  EXPECT_NE(show.output.find("3 ranks x 1 threads, 3 steps"), std::string::npos) << show.output;
  const Outcome played = talus("replay ranks/trace.h5 --ranks 2 --threads 2");
  EXPECT_EQ(played.code, 0) << played.messages;
}

// Replay lays a trace of one rank out on many, which meet in every call. Without frames, which several ranks
// write together and one writes in the background.
TEST_F(TraceCommand, OfOneRankHoldsTheCallsThatSeveralMake) {
  const std::string mpirun =
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe --bind-to none -n 2";
  const std::string line =
      "run scene.toml --threads 1 --trace --set decomposition.subdomains=4 --set output.every_steps=100 "
      "--set output.stage_frames=false --set output.pictures=false --out ";
  talus(line + "one");
  talus(line + "two", mpirun);
  const auto one = calls_of_first(io::read_trace(folder_ / "one/trace.h5")),
             two = calls_of_first(io::read_trace(folder_ / "two/trace.h5"));
  EXPECT_EQ(one, two);
  std::set<int> detecting, cutting;
  for (const auto& [at, calls] : one) {
    if (at.second == "cells") detecting.insert(calls.first);
    if (at.second == "chunks") cutting.insert(calls.first);
  }
  EXPECT_GE(detecting.size(), 3u);  // steps that keep their candidates, look at skin_escapes, cut space
  EXPECT_GE(cutting.size(), 1u);
}

// What a rank adds up in a check grows with its chunks: replay must be able to tell it from the rest.
TEST_F(TraceCommand, HoldsWhatEachCheckAddsUp) {
  for (const int threads : {1, 2}) {
    const trace::Trace trace = io::read_trace(folder_ / recorded("sums" + std::to_string(threads), threads));
    const trace::Timeline timeline(trace);
    int checks = 0;
    for (const std::uint32_t step : timeline.steps()) {
      const trace::StepIndex::Rank rank = timeline.index(step).ranks[0];
      for (std::size_t e = 0; e < rank.epochs; ++e) {
        if (!rank.check[e].exists()) continue;
        ++checks;
        ASSERT_TRUE(rank.alone[e].exists()) << "step " << step << ", epoch " << e;
        EXPECT_EQ(trace.info(timeline.record(rank.alone[e]).kind()).name, "sums");
        EXPECT_LE(timeline.record(rank.alone[e]).end(), timeline.record(rank.check[e]).end());
      }
    }
    EXPECT_GT(checks, 5);
  }
}

TEST_F(TraceCommand, HoldsTheStepsAskedFor) {
  const std::string trace = recorded("some", 1, "--trace-steps 2:3");
  EXPECT_NE(talus("trace show " + trace).output.find("1 threads, 2 steps"), std::string::npos);
  EXPECT_EQ(talus("run scene.toml --out bad --trace --trace-steps 3:2").code, 2);
  EXPECT_FALSE(fs::exists(folder_ / "bad"));
}

TEST_F(TraceCommand, RefusesWhatIsNoTrace) {
  write(folder_ / "text.h5", "not a trace");
  for (const char* command : {"trace show", "replay", "trace export --format svg"}) {
    const Outcome missing = talus(std::string(command) + " nothing.h5");
    EXPECT_EQ(missing.code, 2) << command;
    EXPECT_NE(missing.messages.find("nothing.h5"), std::string::npos) << missing.messages;
    EXPECT_EQ(talus(std::string(command) + " text.h5").code, 2) << command;
  }
  const std::string trace = recorded("out", 1);
  EXPECT_EQ(talus("replay out/results.h5").code, 2);  // HDF5, but no trace
  fs::resize_file(folder_ / trace, fs::file_size(folder_ / trace) * 2 / 3);
  EXPECT_EQ(talus("trace show " + trace).code, 2);
}

// A subdomain's data are brought in between two records, never within one, and change no bit.
TEST_F(TraceCommand, RecordsSubdomainsAsOnCoresOfTheirOwn) {
  const auto follows_at_once = [&](const std::string& file) {
    const trace::Trace trace = io::read_trace(folder_ / file);
    const std::vector<trace::Record>& records = trace.tracks.front().records;
    int pairs = 0;
    for (std::size_t k = 1; k < records.size(); ++k) {
      const trace::Record &before = records[k - 1], &now = records[k];
      const trace::Plan* const plan = trace::plan_of(trace, 0, now.step());
      const auto of_loop = [&](const trace::Record& r) {
        return r.epoch >= 0 && plan && r.node < plan->size() && trace.info(r.kind()).name != "check" &&
               plan->group[r.node] != trace::root_group;
      };
      if (before.step() == now.step() && before.epoch == now.epoch && of_loop(before) && of_loop(now) &&
          plan->group[before.node] != plan->group[now.node] && before.end() == static_cast<double>(now.begin))
        ++pairs;
    }
    return pairs;
  };
  EXPECT_GT(follows_at_once(recorded("plain", 1)), 10);
  EXPECT_EQ(follows_at_once(recorded("own", 1, "--trace-own-caches")), 0);
  EXPECT_EQ(summary(folder_ / "own").at("digest"), summary(folder_ / "plain").at("digest"));
  const Outcome two = talus("run scene.toml --out two --threads 2 --trace --trace-own-caches");
  EXPECT_EQ(two.code, 2);
  EXPECT_NE(two.messages.find("--threads 1"), std::string::npos) << two.messages;
}

TEST_F(TraceCommand, ReplacesAFileOnlyWhenForced) {
  const std::string trace = recorded("out", 1);
  for (const std::string& command : {"trace export " + trace + " --format svg", "replay " + trace}) {
    write(folder_ / "thesis.tex", "mine");
    const Outcome refused = talus(command + " -o thesis.tex");
    EXPECT_EQ(refused.code, 2) << command;
    EXPECT_NE(refused.messages.find("--force"), std::string::npos) << refused.messages;
    EXPECT_EQ(content(folder_ / "thesis.tex"), "mine");
    EXPECT_EQ(talus(command + " -o thesis.tex --force").code, 0) << command;
    EXPECT_NE(content(folder_ / "thesis.tex"), "mine");
    EXPECT_EQ(talus(command + " -o /proc/talus").code, 1) << "not bad input: " << command;
  }
  EXPECT_EQ(talus("replay " + trace + " -o same --smpi-platform same").code, 2);
  EXPECT_FALSE(fs::exists(folder_ / "same"));
}

// SMPI runs the program, which lays subdomains on ranks itself: as in the recording, whatever that was.
TEST_F(TraceCommand, APlatformForSmpiHasNoMapOfItsOwn) {
  const std::string trace = recorded("out", 1);
  const Outcome mapped = talus("replay " + trace + " --ranks 2 --map cyclic --smpi-platform m.xml");
  EXPECT_EQ(mapped.code, 2);
  EXPECT_NE(mapped.messages.find("decomposition.mapping"), std::string::npos) << mapped.messages;
  EXPECT_FALSE(fs::exists(folder_ / "m.xml"));
  ASSERT_EQ(talus("replay " + trace + " --ranks 2 --map cyclic -o cyclic.h5").code, 0);
  const Outcome plain = talus("replay cyclic.h5 --smpi-platform m.xml");
  EXPECT_EQ(plain.code, 0) << plain.messages;
  EXPECT_TRUE(fs::exists(folder_ / "m.xml"));
}

TEST_F(TraceCommand, RefusesMachinesThatMakeNoSense) {
  const std::string trace = recorded("out", 1);
  const Outcome many = talus("replay " + trace + " --ranks 5");
  EXPECT_EQ(many.code, 2);
  EXPECT_NE(many.messages.find("5 ranks for 4 subdomains"), std::string::npos) << many.messages;
  EXPECT_EQ(talus("replay " + trace + " --map random").code, 2);
  EXPECT_EQ(talus("replay " + trace + " --bandwidth 0").code, 2);
  EXPECT_EQ(talus("replay " + trace + " --steps 0").code, 2);
  EXPECT_EQ(talus("replay " + trace + " --speed-of glue=2 publish=3").code, 0);
  for (const char* wrong : {"glue", "glue=fast", "glu=2", "glue=0"})
    EXPECT_EQ(talus("replay " + trace + " --speed-of " + wrong).code, 2) << wrong;
}

}  // namespace
}  // namespace talus::test
