// The errors of this package: the sentence of the C API, and its status as `code`.
export class MaquetteError extends Error {
  constructor(code, message) {
    super(message);
    this.name = 'MaquetteError';
    this.code = code;
  }
}
