/* Functions that glibc 2.28 lacks and that the compiler or libstdc++ of Debian 12 takes for granted. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdint.h>
#include <sys/random.h>
#include <time.h>

/* 2.32: whether the process has one thread, which spares atomic operations. It may always say no. */
char __libc_single_threaded = 0;

/* 2.33: until then they were inline calls of these functions, with the version of the struct. */
struct stat;
int __xstat(int, const char*, struct stat*);
int __lxstat(int, const char*, struct stat*);
int __fxstat(int, int, struct stat*);
int __fxstatat(int, int, const char*, struct stat*, int);
#ifdef __x86_64__
enum { kStat = 1 };
#else
enum { kStat = 0 };
#endif
int stat(const char* path, struct stat* to) { return __xstat(kStat, path, to); }
int lstat(const char* path, struct stat* to) { return __lxstat(kStat, path, to); }
int fstat(int file, struct stat* to) { return __fxstat(kStat, file, to); }
int fstatat(int folder, const char* path, struct stat* to, int flags) {
  return __fxstatat(kStat, folder, path, to, flags);
}
int stat64(const char* path, struct stat* to) { return stat(path, to); }
int lstat64(const char* path, struct stat* to) { return lstat(path, to); }
int fstat64(int file, struct stat* to) { return fstat(file, to); }
int fstatat64(int folder, const char* path, struct stat* to, int flags) { return fstatat(folder, path, to, flags); }

/* Never a part of libc.so: it names the library whose functions they are. */
extern void* __dso_handle __attribute__((visibility("hidden")));
int __register_atfork(void (*)(void), void (*)(void), void (*)(void), void*);
int pthread_atfork(void (*before)(void), void (*in_parent)(void), void (*in_child)(void)) {
  return __register_atfork(before, in_parent, in_child, __dso_handle);
}

/* 2.36 */
uint32_t arc4random(void) {
  uint32_t number = 0;
  while (getrandom(&number, sizeof number, 0) != (ssize_t)sizeof number) {
  }
  return number;
}

/* The deadline by the real-time clock. */
static struct timespec real_time(clockid_t clock, const struct timespec* until) {
  struct timespec now, real, at = *until;
  if (clock == CLOCK_REALTIME) return at;
  clock_gettime(clock, &now);
  clock_gettime(CLOCK_REALTIME, &real);
  int64_t ns = (until->tv_sec - now.tv_sec + real.tv_sec) * 1000000000LL + until->tv_nsec - now.tv_nsec + real.tv_nsec;
  at.tv_sec = ns / 1000000000;
  at.tv_nsec = ns % 1000000000;
  return at;
}

/* 2.30: those of the system where it has them, which do not heed changes of the real-time clock. */
int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const struct timespec* until) {
  typedef int Function(pthread_cond_t*, pthread_mutex_t*, clockid_t, const struct timespec*);
  static Function* found = NULL;
  static char is_known = 0;
  if (!__atomic_load_n(&is_known, __ATOMIC_ACQUIRE)) {
    *(void**)&found = dlsym(RTLD_DEFAULT, "pthread_cond_clockwait");
    __atomic_store_n(&is_known, 1, __ATOMIC_RELEASE);
  }
  if (found != NULL) return found(condition, mutex, clock, until);
  const struct timespec real = real_time(clock, until);
  return pthread_cond_timedwait(condition, mutex, &real);
}

int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock, const struct timespec* until) {
  const struct timespec real = real_time(clock, until);
  return pthread_mutex_timedlock(mutex, &real);
}

#include "hypot.c" /* 2.35 rounds better than before */
