/* Prints, one a line, which of the instructions that matter to int8 networks this processor offers to programs, by the
   names of Linux. benchmarks/processors runs it in each emulator, so that no processor is compared that is not the one
   it is said to be. */
#include <stdio.h>

#if defined(__aarch64__)
#include <asm/hwcap.h>
#include <sys/auxv.h>

int main(void) {
  const unsigned long first = getauxval(AT_HWCAP), second = getauxval(AT_HWCAP2);
  if (first & HWCAP_ASIMD) puts("asimd");
  if (first & HWCAP_ASIMDDP) puts("asimddp");
  if (second & HWCAP2_I8MM) puts("i8mm");
  return 0;
}
#elif defined(__x86_64__)
int main(void) {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2")) puts("avx2");
  if (__builtin_cpu_supports("fma")) puts("fma");
  if (__builtin_cpu_supports("avx512f")) puts("avx512f");
  if (__builtin_cpu_supports("avx512vnni")) puts("avx512_vnni");
  if (__builtin_cpu_supports("avxvnni")) puts("avx_vnni");
  if (__builtin_cpu_supports("amx-int8")) puts("amx_int8");
  return 0;
}
#else
int main(void) { return 0; }
#endif
