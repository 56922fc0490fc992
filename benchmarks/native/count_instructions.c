/* A plugin of qemu-user: adds the instructions that the emulated program has executed to a counter in a file, 8 bytes
 * of this machine's byte order.
 *
 *   cc -shared -fPIC -o count_instructions.so count_instructions.c
 *   qemu-aarch64 -plugin ./count_instructions.so,counter=FILE PROGRAM
 *
 * The program may map the file and read the counter at any time (instruction_clock.c does). A block of instructions
 * counts as a whole when it is entered. Threads share the counter without locks: it is exact while one of them works.
 * For QEMU 7 and 8, whose packages have no header for plugins: the functions are as its documentation of the interface
 * (docs/devel/tcg-plugins) declares them. */
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

struct qemu_plugin_tb;
void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t id, void (*translated)(uint64_t, struct qemu_plugin_tb*));
void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb* block, int operation, void* at, uint64_t value);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb* block);

int qemu_plugin_version = 1; /* of the interface */

static uint64_t* counter;

static void translated(uint64_t id, struct qemu_plugin_tb* block) {
  const int add_u64 = 0;
  (void)id;
  qemu_plugin_register_vcpu_tb_exec_inline(block, add_u64, counter, qemu_plugin_tb_n_insns(block));
}

int qemu_plugin_install(uint64_t id, const void* info, int argc, char** argv) {
  static const char kOption[] = "counter=";
  int file;
  (void)info;
  if (argc != 1 || strncmp(argv[0], kOption, sizeof kOption - 1) != 0) {
    fprintf(stderr, "count_instructions: one option is needed, counter=FILE\n");
    return 1;
  }
  file = open(argv[0] + sizeof kOption - 1, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0 || ftruncate(file, sizeof *counter) != 0) {
    perror(argv[0]);
    return 1;
  }
  counter = mmap(NULL, sizeof *counter, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (counter == MAP_FAILED) {
    perror(argv[0]);
    return 1;
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
  return 0;
}
