#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace talus {

/// Starts a program, waits for it, and returns its exit code, or 128 + the signal that ended it. Its output
/// and messages go to the file `log`. `words`: the program, looked up in PATH, and its arguments; no shell is
/// asked. One at a time. Throws std::runtime_error naming the program when it cannot be started, and when
/// SIGINT or SIGTERM came while it ran: it has ended by then.
int run_child(const std::vector<std::string>& words, const std::filesystem::path& log);

/// Whether a program of that name, or at that path, can be started.
bool program_exists(const std::string& name);

/// Path of the running program.
std::string own_path();

/// The words as a line for a shell, quoted where they must be.
std::string shell_line(const std::vector<std::string>& words);

/// Words of a text between spaces.
std::vector<std::string> split_words(const std::string& text);

/// The last lines of a text file, for a message; "" when it cannot be read.
std::string tail_of(const std::filesystem::path& file, std::size_t lines = 5);

}  // namespace talus
