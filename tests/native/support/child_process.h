// Runs a function in a child process, which may die or hang, and tells what became of it.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>

// The child's output, and how it ended: "" for well, else "hangs", "ends by signal 11", "exits with 3".
struct ChildOutcome {
  std::string said;
  std::string trouble;
};

// `body` is given the descriptor of a pipe to write() to, which holds 64 KiB, and returns the exit code.
template <class Body>
ChildOutcome run_in_child(Body&& body, unsigned limit_s = 60) {
  int ends[2];
  if (pipe(ends) != 0) return {"", "has no pipe"};
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    alarm(limit_s);  // ends it by SIGALRM
    try {
      _exit(body(ends[1]));
    } catch (const std::exception& error) {
      [[maybe_unused]] const ssize_t written = write(ends[1], error.what(), std::strlen(error.what()));
      _exit(99);
    }
  }
  close(ends[1]);
  ChildOutcome outcome;
  char block[4096];
  for (ssize_t count; (count = read(ends[0], block, sizeof block)) > 0;) outcome.said.append(block, size_t(count));
  close(ends[0]);
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child) {
    outcome.trouble = "cannot be made";
  } else if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    outcome.trouble = signal == SIGALRM ? "hangs" : "ends by signal " + std::to_string(signal);
  } else if (WEXITSTATUS(status) != 0) {
    outcome.trouble = "exits with " + std::to_string(WEXITSTATUS(status));
  }
  return outcome;
}
