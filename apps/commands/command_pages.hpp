#pragma once

/// What shells and `man` know of the table of commands.

#include <span>
#include <string>

#include "apps/commands/command.hpp"

namespace talus {

/// A script for bash that completes commands, their options and files: `source <(talus completion bash)`.
std::string bash_completion(std::span<const Command> table);

/// The page talus(1) as troff with the macros of man(7).
std::string man_page(std::span<const Command> table);

}  // namespace talus
