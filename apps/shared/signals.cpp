#include "apps/shared/signals.hpp"

#include <atomic>
#include <csignal>

namespace talus {

namespace {

std::atomic<int> stop{0};
std::atomic<bool> save{false};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

extern "C" void ask_to_stop(int signal) {
  if (stop.exchange(signal) == 0) return;
  // As if it had never been caught: the exit status names it, and nothing waits for the step.
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

extern "C" void ask_to_save(int) {
  save.store(true);
}

void handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigaction(signal, &action, nullptr);
}

}  // namespace

void catch_signals() {
  for (const int signal : {SIGTERM, SIGINT, SIGXCPU}) handle(signal, ask_to_stop);
  struct sigaction before {};
  sigaction(SIGHUP, nullptr, &before);
  if (before.sa_handler != SIG_IGN) handle(SIGHUP, ask_to_stop);
  handle(SIGUSR1, ask_to_save);
}

int stop_signal() {
  return stop.load();
}

bool save_was_asked() {
  return save.exchange(false);
}

const char* signal_name(int signal) {
  switch (signal) {
    case SIGTERM:
      return "SIGTERM";
    case SIGINT:
      return "SIGINT";
    case SIGHUP:
      return "SIGHUP";
    case SIGXCPU:
      return "SIGXCPU";
    default:
      return "a signal";
  }
}

}  // namespace talus
