#include "io/files/detail/rehearsal.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "io/files/error.hpp"

namespace talus::io::detail {
namespace {

// A sanitizer takes terabytes of addresses, says on stderr whose fault a crash is, and needs its handlers.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool sanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif
#else
constexpr bool sanitized = false;
#endif

void limit(decltype(RLIMIT_CORE) resource, rlim_t most) {
  rlimit now{};
  if (::getrlimit(resource, &now) != 0) return;
  now.rlim_cur = now.rlim_max = std::min(now.rlim_max, most);
  ::setrlimit(resource, &now);
}

/// The addresses that this process has [byte]; 0 where the system does not tell.
rlim_t addresses_taken() {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

/// What reading a file of `bytes` may take, generously. deflate packs grains at rest 30 to 1, and unpacks
/// 5 MB/s of them at least.
void limit_child(rlim_t bytes) {
  // Or a killed run would have the folder for a little longer, locked and perhaps written to.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlim_t seconds = 3 + bytes / 5'000'000;
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, seconds);
  // A child that waits for a lock takes no time of the processor.
  std::signal(SIGALRM, SIG_DFL);
  ::alarm(static_cast<unsigned>(std::min<rlim_t>(20 * seconds, 1 << 30)));
  if (sanitized) return;
  if (const rlim_t taken = addresses_taken(); taken > 0)
    limit(RLIMIT_AS, taken + (rlim_t{1} << 30) + 64 * bytes);
  // Handlers of MPI write what they know of the crash to the terminal, as does the C library.
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL}) std::signal(signal, SIG_DFL);
  if (const int nowhere = ::open("/dev/null", O_WRONLY); nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
}

// What the child says at its end, followed by the words of the error. One that says nothing is dead.
constexpr char went_well = '+', refused = '-', our_fault = '!';

// What escapes here ends the child, as a crash does: it must not unwind what its parent was about.
[[noreturn]] void be_the_child(int verdict, const std::string& path,
                               const std::function<void()>& work) noexcept {
  std::error_code unknown;
  const auto bytes = std::filesystem::file_size(path, unknown);
  limit_child(unknown ? 0 : bytes);
  std::string words;
  try {
    work();
    words = went_well;
  } catch (const FileError& error) {
    words = refused + std::string(error.what());
  } catch (const std::bad_alloc&) {  // no memory left below the limit
  } catch (const std::exception& error) {
    words = our_fault + std::string(error.what());
  }
  for (std::string_view rest = words; !rest.empty();) {
    const ssize_t written = ::write(verdict, rest.data(), rest.size());
    if (written < 0 && errno != EINTR) break;
    rest.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
  }
  ::_exit(0);  // without the cleaning at exit of MPI and of this process's own streams
}

/// By its limits of time, or from outside: that may have happened to a whole file, too.
bool was_stopped(int status) {
  if (!WIFSIGNALED(status)) return false;
  const int signal = WTERMSIG(status);
  return signal == SIGALRM || signal == SIGXCPU || signal == SIGKILL;
}

std::string all_from(int pipe) {
  std::string words;
  char some[512];
  for (;;) {
    const ssize_t count = ::read(pipe, some, sizeof(some));
    if (count > 0) words.append(some, static_cast<std::size_t>(count));
    if (count == 0 || (count < 0 && errno != EINTR)) return words;
  }
}

}  // namespace

bool done_in_a_child(const std::string& path, const std::string& remedy, const std::function<void()>& work) {
  int verdict[2];
  if (this_process_may_die || ::pipe2(verdict, O_CLOEXEC) != 0) return false;
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(verdict[0]);
    be_the_child(verdict[1], path, work);
  }
  ::close(verdict[1]);
  // The words tell, and not the status, which the system drops where children are ignored (SIGCHLD).
  const std::string words = child > 0 ? all_from(verdict[0]) : "";
  ::close(verdict[0]);
  if (child < 0) return false;
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(child, &status, 0)) < 0 && errno == EINTR) {
  }
  if (words.empty() && ended == child && was_stopped(status))
    throw FileError(
        path,
        "is damaged, or this machine is too busy to read it: HDF5 took more time than such a file "
        "needs. Try again; " +
            remedy);
  if (words.empty()) throw FileError(path, "is damaged: HDF5 would crash or run wild in it; " + remedy);
  if (words.front() == went_well) return true;
  if (words.front() == our_fault) throw std::logic_error(path + ": " + words.substr(1));
  const std::string told = words.substr(1), prefix = path + ": ";
  throw FileError(path, told.starts_with(prefix) ? told.substr(prefix.size()) : told);
}

}  // namespace talus::io::detail
