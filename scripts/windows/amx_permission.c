/* For LD_PRELOAD: asks Linux for AMX before Wine starts. Windows gives it to every program, so its ONNX Runtime uses
 * AMX wherever the processor has it; Wine 8 does not ask, and the first tile would be an illegal instruction. Elsewhere
 * the call fails and changes nothing. */
#define _GNU_SOURCE
#include <sys/syscall.h>
#include <unistd.h>

enum { kRequestPermission = 0x1023, kTileData = 18 }; /* ARCH_REQ_XCOMP_PERM, XFEATURE_XTILEDATA */

__attribute__((constructor)) static void ask_for_amx(void) { syscall(SYS_arch_prctl, kRequestPermission, kTileData); }
