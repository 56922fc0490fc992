/* The first code of a program, in place of the C library's. glibc runs a program's initialisers by itself since 2.34;
 * before, the program's own start did. This start works with both. */
typedef void Initialiser(int, char**, char**);
extern Initialiser *__init_array_start[], *__init_array_end[];
int main(int, char**, char**);
int __libc_start_main(int (*)(int, char**, char**), int, char**, Initialiser*, void (*)(void), void (*)(void), void*);

void* __dso_handle = 0;

static void initialise(int argc, char** argv, char** environment) {
  for (Initialiser** one = __init_array_start; one != __init_array_end; ++one) (*one)(argc, argv, environment);
}

__attribute__((used, noreturn)) void maquette_start(long* stack, void (*end_of_loader)(void)) {
  __libc_start_main(main, (int)stack[0], (char**)(stack + 1), initialise, 0, end_of_loader, stack);
  __builtin_unreachable();
}

__asm__(
    ".text\n.globl _start\n.type _start, %function\n_start:\n"
#ifdef __x86_64__
    "xorl %ebp, %ebp\nmovq %rsp, %rdi\nmovq %rdx, %rsi\nandq $-16, %rsp\ncall maquette_start\nhlt\n"
#else
    "mov x29, #0\nmov x30, #0\nmov x1, x0\nmov x0, sp\nb maquette_start\n"
#endif
);
