// The streams that a program begins with.
#pragma once

// Makes lost output an error, told and cleaned up after, and not the end of the process.
void prepare_standard_streams();
