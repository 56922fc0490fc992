// Lets oneDNN use AMX on virtual machines that announce it (CPUID leaf 7) and run it, but leave the leaves that
// describe its tiles (0x1D, 0x1E) empty. There oneDNN configures no tiles, and the first bfloat16 matrix product ends
// with an illegal instruction.
//
// Preloaded by scripts/with-amx.sh. The kernel is asked to trap CPUID (arch_prctl ARCH_SET_CPUID); the handler runs the
// instruction and fills in the two leaves with what all processors with AMX have so far: palette 1, 8 tiles of 16 rows
// of 64 bytes (Intel 64 and IA-32 Architectures Software Developer's Manual, volume 1, chapter 18).
#define _GNU_SOURCE
#include <cpuid.h>
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

enum { ARCH_SET_CPUID = 0x1012, LEAF_TILES = 0x1d, LEAF_TMUL = 0x1e };

static int trapping;

static int set_action(int signal, const struct sigaction* action, struct sigaction* before) {
  static int (*next)(int, const struct sigaction*, struct sigaction*);
  if (!next) *(void**)&next = dlsym(RTLD_NEXT, "sigaction");
  return next(signal, action, before);
}

// Python's faulthandler, which torchrun switches on, would take the trap for a crash.
int sigaction(int signal, const struct sigaction* action, struct sigaction* before) {
  if (signal != SIGSEGV || !trapping || !action) return set_action(signal, action, before);
  if (before) memset(before, 0, sizeof *before);
  return 0;
}

static void on_fault(int signal, siginfo_t* info, void* context) {
  (void)info;
  greg_t* registers = ((ucontext_t*)context)->uc_mcontext.gregs;
  const unsigned char* at = (const unsigned char*)registers[REG_RIP];
  if (at[0] != 0x0f || at[1] != 0xa2) {  // no CPUID: a true fault, which comes again when this returns
    trapping = 0;
    const struct sigaction standard = {.sa_handler = SIG_DFL};
    set_action(signal, &standard, NULL);
    return;
  }
  const unsigned leaf = (unsigned)registers[REG_RAX], part = (unsigned)registers[REG_RCX];
  unsigned a, b, c, d;
  syscall(SYS_arch_prctl, ARCH_SET_CPUID, 1);
  __cpuid_count(leaf, part, a, b, c, d);
  syscall(SYS_arch_prctl, ARCH_SET_CPUID, 0);
  if (leaf == 0 && a < LEAF_TMUL) a = LEAF_TMUL;
  if (leaf == LEAF_TILES && part == 0) a = 1, b = c = d = 0;                                      // highest palette
  if (leaf == LEAF_TILES && part == 1) a = 1024u << 16 | 8192, b = 8u << 16 | 64, c = 16, d = 0;  // bytes, tiles, rows
  if (leaf == LEAF_TMUL && part == 0) a = 0, b = 64u << 8 | 16, c = d = 0;                        // 16 rows by 64 bytes
  registers[REG_RAX] = a, registers[REG_RBX] = b, registers[REG_RCX] = c, registers[REG_RDX] = d;
  registers[REG_RIP] += 2;
}

__attribute__((constructor)) static void start(void) {
  struct sigaction action = {.sa_sigaction = on_fault, .sa_flags = SA_SIGINFO | SA_NODEFER};
  set_action(SIGSEGV, &action, NULL);
  if (syscall(SYS_arch_prctl, ARCH_SET_CPUID, 0) == 0)
    trapping = 1;
  else
    perror("with-amx: this kernel or processor cannot trap CPUID");
}
