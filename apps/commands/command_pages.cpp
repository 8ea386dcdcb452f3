#include "apps/commands/command_pages.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <functional>
#include <vector>

#include "io/results/version.hpp"

namespace talus {

namespace {

/// A command or group by its whole name, "talus study error", with its options as CLI11 has them.
struct Described {
  std::string path;
  const Command* command;
  std::vector<std::string> inside;  ///< names of the commands of a group
};

std::vector<Described> described(std::span<const Command> table, const std::string& path) {
  std::vector<Described> all;
  for (const Command& command : table) {
    Described here{path + " " + command.name, &command, {}};
    for (const Command& inner : command.subcommands) here.inside.push_back(inner.name);
    const std::string below = here.path;
    all.push_back(std::move(here));
    for (Described& inner : described(command.subcommands, below)) all.push_back(std::move(inner));
  }
  return all;
}

/// Calls `visit` for each option of a command.
void each_option(const Command& command, const std::function<void(const CLI::Option&)>& visit) {
  if (!command.add_options) return;
  CLI::App app;
  const CommandRun run = command.add_options(app);  // holds what the options write to
  for (const CLI::Option* option : app.get_options()) visit(*option);
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// Text in which troff sees no request and no escape.
std::string troff(const std::string& text) {
  std::string out = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char letter : text) {
    if (letter == '\\')
      out += "\\e";
    else if (letter == '-')
      out += "\\-";
    else if (letter == '\n')
      out += ' ';
    else
      out += letter;
  }
  return out;
}

}  // namespace

std::string bash_completion(std::span<const Command> table) {
  std::vector<std::string> top{"--help", "--version"};
  std::string paths, words;
  for (const Command& command : table) top.push_back(command.name);
  for (const Described& each : described(table, "talus")) {
    paths += (paths.empty() ? "" : "|") + fmt::format("'{}'", each.path);
    std::vector<std::string> of = each.inside;
    each_option(*each.command, [&](const CLI::Option& option) {
      for (const std::string& name : option.get_lnames()) of.push_back("--" + name);
    });
    if (each.inside.empty() && of.empty()) of.push_back("--help");
    words += fmt::format("    '{}') words='{}' ;;\n", each.path, joined(of));
  }
  return fmt::format(R"(# Completion of talus {}, for bash: source <(talus completion bash)
_talus() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} path=talus words='' word
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$path $word" in {}) path="$path $word" ;; esac
  done
  case "$path" in
    talus) words='{}' ;;
{}  esac
  COMPREPLY=($(compgen -W "$words" -- "$current"))
  if [ ${{#COMPREPLY[@]}} -eq 0 ] && [ "$path" != talus ]; then COMPREPLY=($(compgen -f -- "$current")); fi
}}
complete -o filenames -F _talus talus
)",
                     io::version(), paths, joined(top), words);
}

std::string man_page(std::span<const Command> table) {
  std::string page = fmt::format(
      ".TH TALUS 1 \"\" \"Talus {}\" \"User Commands\"\n.SH NAME\ntalus \\- dense granular matter by "
      "nonsmooth contact dynamics\n.SH SYNOPSIS\n.B talus\n.I COMMAND\n[\\fIOPTIONS\\fR]\n.SH COMMANDS\n",
      troff(io::version()));
  for (const Described& each : described(table, "talus")) {
    page += fmt::format(".SS \"{}\"\n{}.\n", troff(each.path), troff(each.command->sentence));
    each_option(*each.command, [&](const CLI::Option& option) {
      std::string name = option.get_name(false, true);
      if (option.get_items_expected_max() > 0 && !option.get_type_name().empty())
        name += " " + option.get_type_name();
      page += fmt::format(".TP\n.B {}\n{}\n", troff(name), troff(option.get_description()));
    });
  }
  page +=
      ".SH EXIT STATUS\n.TP\n.B 0\ndone\n.TP\n.B 1\nfailed\n.TP\n.B 2\nbad input, nothing was "
      "written\n.TP\n.B 3\ndone, but a step or problem missed its tolerance\n.TP\n.B 75\nstopped, and "
      "\\-\\-resume goes on from there\n.SH SEE ALSO\ndocs/tutorial.md, docs/scenes.md and docs/formats.md "
      "of the sources, in /usr/share/doc/talus of the package\n";
  return page;
}

}  // namespace talus
