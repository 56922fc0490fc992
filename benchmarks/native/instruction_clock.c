/* Preloaded into an emulated program: its monotonic clock returns the number of executed instructions, one as a
 * nanosecond. A measured time of 1 ms then means a million instructions.
 *
 *   cc -shared -fPIC -o instruction_clock.so instruction_clock.c
 *   MAQ_INSTRUCTION_COUNTER=FILE LD_PRELOAD=instruction_clock.so PROGRAM      FILE: count_instructions.c writes it */
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static const volatile uint64_t* counter;

__attribute__((constructor)) static void map_counter(void) {
  const char* path = getenv("MAQ_INSTRUCTION_COUNTER");
  const int file = path == NULL ? -1 : open(path, O_RDONLY | O_CLOEXEC);
  void* at = file < 0 ? MAP_FAILED : mmap(NULL, sizeof *counter, PROT_READ, MAP_SHARED, file, 0);
  if (at == MAP_FAILED) {
    fprintf(stderr, "instruction_clock: the counter %s cannot be read\n", path == NULL ? "(not named)" : path);
    _exit(1);
  }
  close(file);
  counter = at;
}

int clock_gettime(clockid_t clock, struct timespec* time) {
  if (clock != CLOCK_MONOTONIC || counter == NULL) return (int)syscall(SYS_clock_gettime, clock, time);
  const uint64_t instructions = *counter;
  time->tv_sec = (time_t)(instructions / 1000000000u);
  time->tv_nsec = (long)(instructions % 1000000000u);
  return 0;
}
