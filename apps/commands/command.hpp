#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <memory>
#include <vector>

namespace talus {

/// The words that the program was started with, as main has them.
struct CommandLine {
  int argc = 0;
  char** argv = nullptr;
};

/// Runs a command whose options have been parsed; returns an ExitCode.
using CommandRun = std::function<int(CommandLine)>;

/// A command of `talus`, or a group of commands such as `talus study`.
struct Command {
  const char* name;      ///< as it is typed
  const char* sentence;  ///< for --help
  /// Adds the options to the subcommand of CLI11; what it returns holds their values and must outlive the
  /// parsing. Empty for a group.
  std::function<CommandRun(CLI::App&)> add_options = {};
  std::vector<Command> subcommands = {};  ///< of a group, in the order of --help
};

/// A command whose options are the members of an `Options`, which begins as its defaults.
template <class Options>
Command command(const char* name, const char* sentence, void (*add_options)(CLI::App&, Options&),
                int (*run)(Options&, CommandLine)) {
  return {name, sentence, [add_options, run](CLI::App& app) -> CommandRun {
            const auto options = std::make_shared<Options>();
            add_options(app, *options);
            return [options, run](CommandLine line) { return run(*options, line); };
          }};
}

}  // namespace talus
