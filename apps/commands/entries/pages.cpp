#include <fmt/format.h>

#include <string>

#include "apps/commands/command_pages.hpp"
#include "apps/commands/commands.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"

namespace talus {

namespace {

struct CompletionOptions {
  std::string shell;
};
struct ManOptions {};

int print_completion(CompletionOptions& options, CommandLine) {
  if (options.shell != "bash") {
    print_error("talus: error: there is no completion for '{}': bash\n", options.shell);
    return exit_bad_input;
  }
  print_out("{}", bash_completion(commands()));
  return exit_done;
}

int print_man(ManOptions&, CommandLine) {
  print_out("{}", man_page(commands()));
  return exit_done;
}

}  // namespace

Command completion_entry() {
  return command<CompletionOptions>(
      "completion", "print what completes commands and options in a shell",
      [](CLI::App& app, CompletionOptions& options) {
        app.add_option("shell", options.shell, "bash: source <(talus completion bash)")
            ->type_name("SHELL")
            ->required();
      },
      print_completion);
}

Command man_entry() {
  return command<ManOptions>(
      "man", "print the page talus(1): talus man | man -l -", [](CLI::App&, ManOptions&) {}, print_man);
}

}  // namespace talus
