#include "sextant/base/interrupt.h"

#include <pthread.h>
#include <semaphore.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <map>
#include <mutex>
#include <thread>

namespace sextant {
namespace {

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

sem_t signal_came;

void on_signal(int) {
  interrupted = true;
  ::sem_post(&signal_came);
}

/// State of the watcher thread. Never destroyed: the watcher may outlive static objects.
struct Watch {
  std::string last_words;
  int exit_code = 0;
  std::timed_mutex mutex;
  std::map<std::filesystem::path, pid_t> folders;  ///< with the process that created each
};

Watch& watch() {
  static Watch* const the_watch = new Watch;
  return *the_watch;
}

/// Removes a folder in which another thread or a child process, such as gnuplot, may still create files:
/// under a new name, which they do not know.
void remove_in_use(const std::filesystem::path& folder) {
  std::filesystem::path renamed = folder;
  renamed += ".removed";
  std::error_code error;
  std::filesystem::rename(folder, renamed, error);
  const std::filesystem::path& left = error ? folder : renamed;
  constexpr int most_tries = 10;
  for (int i = 0; i < most_tries && std::filesystem::exists(left, error); ++i) {
    if (i > 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::filesystem::remove_all(left, error);
  }
}

void* end_after_signal(void*) {
  while (::sem_wait(&signal_came) != 0 && errno == EINTR) {
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(interrupt_grace_s));
  Watch& w = watch();
  // The mutex is never unlocked, so that no folder is added from here on.
  if (w.mutex.try_lock_for(std::chrono::milliseconds(100))) {
    for (const auto& [folder, creator] : w.folders) {
      if (creator == ::getpid()) remove_in_use(folder);  // not that of the process that forked this one
    }
  }
  // A write to a closed standard error fails, which needs no handling.
  if (::write(STDERR_FILENO, w.last_words.data(), w.last_words.size()) < 0) {
  }
  std::_Exit(w.exit_code);
}

/// Starts a thread with a small stack that receives no signals. If no thread can be created (`ulimit -u`),
/// check_interrupt() still works.
void start_watcher() {
  sigset_t all, before;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  pthread_attr_t attributes;
  ::pthread_attr_init(&attributes);
  ::pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
  ::pthread_attr_setstacksize(&attributes, size_t{1} << 18);
  pthread_t thread;
  ::pthread_create(&thread, &attributes, &end_after_signal, nullptr);
  ::pthread_attr_destroy(&attributes);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace

void install_interrupt_handler(std::string last_words, int exit_code) {
  watch().last_words = std::move(last_words);
  watch().exit_code = exit_code;
  ::sem_init(&signal_came, 0, 0);
  start_watcher();
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESETHAND;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool is_interrupted() { return interrupted; }

void check_interrupt() {
  if (interrupted) throw Interrupted();
}

std::filesystem::path create_watched_folder(const std::function<std::filesystem::path()>& create) {
  const std::scoped_lock lock(watch().mutex);
  return watch().folders.emplace(create(), ::getpid()).first->first;
}

void remove_watched_folder(const std::filesystem::path& folder) {
  {
    const std::scoped_lock lock(watch().mutex);
    if (watch().folders.at(folder) != ::getpid()) return;
  }
  // Unregistered last: the watcher removes the rest of a folder whose removal it interrupts.
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  const std::scoped_lock lock(watch().mutex);
  watch().folders.erase(folder);
}

}  // namespace sextant
