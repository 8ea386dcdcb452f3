
#include <fcntl.h>
#include <fmt/format.h>
#include <hdf5.h>
#include <malloc.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "apps/commands/commands.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "io/results/run_json.hpp"
#include "io/results/version.hpp"
#include "io/scene/detail/foreign_words.hpp"
#include "io/scene/detail/spelling.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "runtime/graph/clock.hpp"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace talus {

namespace {

#ifdef H5_HAVE_PARALLEL
constexpr bool parallel_hdf5 = true;
#else
constexpr bool parallel_hdf5 = false;
#endif

/// The commands of `app` as far as they were recognised, "talus study error", and the last of them.
std::pair<std::string, const CLI::App*> recognised(const CLI::App* app) {
  std::string command = "talus";
  while (!app->get_subcommands().empty()) {
    app = app->get_subcommands().front();
    command += " " + app->get_name();
  }
  return {command, app};
}

/// What was meant by a word that is no option: something of another program, or one that is spelled nearly
/// so.
std::string option_hint(const CLI::App& app, const std::string& word) {
  if (const std::string foreign = io::detail::foreign_hint(word); !foreign.empty()) return foreign;
  std::vector<std::string> known;
  for (const CLI::Option* option : app.get_options()) known.push_back(option->get_name());
  const std::string meant = io::detail::nearest(word, known);
  return meant.empty() ? "" : fmt::format("; did you mean '{}'?", meant);
}

/// What is wrong with the command line, and where to read what is right.
std::string failure_message(const CLI::App* of, const CLI::Error& error) {
  const auto [command, app] = recognised(of);
  std::string what = error.what();
  // CLI11 misses a command before it looks at the word that stands in its place.
  if (const auto words = app->remaining(); error.get_name() == "RequiredError" && !words.empty()) {
    std::vector<std::string> known;
    for (const CLI::App* each : app->get_subcommands({})) known.push_back(each->get_name());
    if (!known.empty())
      what = fmt::format("'{}' is no command of {}{}", words.front(), command,
                         io::detail::hint(words.front(), known));
  }
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError))
    for (const std::string& word : app->remaining(true))
      if (word.starts_with('-')) {
        what = fmt::format("{} has no option {}{}", command, word, option_hint(*app, word));
        break;
      }
  // CLI11's words for numbers that are none, or not whole, or beyond their range.
  if (const std::string words = "Could not convert: "; what.starts_with(words))
    what = what.substr(words.size()) + " is no number of the kind that is asked for";
  return fmt::format("talus: error: {}; `{} --help` lists what there is\n", what, command);
}

/// An empty value is what a variable of a script that is not set leaves: no file and no directory is meant.
void refuse_empty_values(CLI::App& app) {
  for (CLI::Option* option : app.get_options({}))
    if (option->get_expected_max() > 0)
      option->check(CLI::Validator(
          [](const std::string& value) {
            return std::string(value.empty() ? "the value is empty: give one, or leave the option out" : "");
          },
          ""));
}

/// A command that CLI11 knows, and what runs it.
struct AddedCommand {
  const CLI::App* app;
  CommandRun run;
};

/// Version, build and licence; the first line is the version alone.
std::string version_text() {
  const io::Provenance build = io::collect_provenance();
  return fmt::format(
      "talus {}\ncommit {}{}, {} build by {}: {}\nfeatures: {}, OpenMP, HDF5 {}.{}.{}{}, METIS; sweeps here "
      "by {}\nlicence: Apache-2.0",
      io::version(), build.git_hash, build.git_dirty ? " with changes" : "", build.build_type, build.compiler,
      build.flags, graph::simulated_ranks ? "simulated ranks (SimGrid)" : "MPI", H5_VERS_MAJOR, H5_VERS_MINOR,
      H5_VERS_RELEASE, parallel_hdf5 ? " (parallel)" : "",
      name_of(SweepKernels(InstructionSet::automatic).set()));
}

/// Adds the commands and groups of the table to `parent`, and to `added` what can be run.
void add_commands(CLI::App& parent, const std::vector<Command>& table, std::vector<AddedCommand>& added) {
  for (const Command& command : table) {
    CLI::App* app = parent.add_subcommand(command.name, command.sentence);
    if (command.add_options) {
      added.push_back({app, command.add_options(*app)});
      refuse_empty_values(*app);
    } else {
      app->require_subcommand(1);
      add_commands(*app, command.subcommands, added);
    }
  }
}

/// Standard streams that the caller has closed get a place that holds nothing, lest a file of results take
/// their number and messages go into it. Of stdout it is one that refuses what is written.
void occupy_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(stream, F_GETFD) < 0 && errno == EBADF)
      ::open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY);
}

/// Arrays go back to the system when they are freed. glibc does so with large ones until one is freed; from
/// then on it keeps all up to that size, of 32 MB at most, and the gaps between them: of 10^6 grains 160 MB
/// more than the arrays that there were. Smaller arrays are reused in place: each page that the system gives
/// is a fault and is cleared. Given back from 256 kB on, as the arrays of 16,000 grains are, that took 5 %
/// of a step.
void give_back_arrays() {
#ifdef __GLIBC__
  constexpr int array = 1 << 21;  // with 4 MB a run of 10^6 grains takes 4 % more memory than with 256 kB
  ::mallopt(M_MMAP_THRESHOLD, array);
  ::mallopt(M_TRIM_THRESHOLD, 8 * array);
#endif
}

/// Nobody reads the pipe any more that stdout is, as `head` when it has seen what it wanted.
bool reader_has_gone() {
  pollfd out{STDOUT_FILENO, 0, 0};
  return ::poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0;
}

/// The exit code of a command that ended with `code`: results that stdout did not take are an error,
/// of which a reader that has gone is not told.
int with_results_written(int code) {
  errno = 0;
  const bool whole = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (whole) return code;
  const std::string reason = errno == 0 ? "" : ": " + std::generic_category().message(errno);
  if (!reader_has_gone()) print_error("talus: error: the results could not be written to stdout{}\n", reason);
  return code == exit_done ? exit_failure : code;
}

/// What a command does not catch itself ends here: a task that has no memory left, above all.
int run_guarded(const CommandRun& run, CommandLine line) {
  try {
    return run(line);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
}

}  // namespace

}  // namespace talus

int main(int argc, char** argv) {
  using namespace talus;
  occupy_closed_streams();
  give_back_arrays();
  // Who reads stdout or stderr may go before a simulation ends: then writing fails, and nothing else.
  std::signal(SIGPIPE, SIG_IGN);
  // The same for files beyond a limit: else the system ends a run that says "running" for ever.
  std::signal(SIGXFSZ, SIG_IGN);
  // It asks a run for a checkpoint, and goes to all processes of a job: it ends none that has nothing to
  // save.
  std::signal(SIGUSR1, SIG_IGN);
  CLI::App app{"Talus: dense granular matter by nonsmooth contact dynamics"};
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done; 1 failed; 2 bad input, nothing was written; 3 done, but a step or problem missed "
      "its\ntolerance; 75 stopped (`talus run` goes on with --resume). First run: docs/tutorial.md; files it "
      "leaves: docs/formats.md");
  app.failure_message(failure_message);

  std::vector<AddedCommand> added;
  add_commands(app, commands(), added);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return with_results_written(app.exit(error) == 0 ? exit_done : exit_bad_input);
  }
  for (const AddedCommand& command : added)
    if (*command.app) return with_results_written(run_guarded(command.run, {argc, argv}));
  return exit_done;
}
