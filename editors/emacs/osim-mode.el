;;; osim-mode.el --- OpenSim models: XML with osimlite's language server -*- lexical-binding: t -*-
;; Emacs 29 brings eglot along; older ones find it on GNU ELPA (Debian: elpa-eglot).
;; Put this file on your load-path, and (require 'osim-mode) into your init file.

(require 'nxml-mode)

(define-derived-mode osim-mode nxml-mode "OpenSim"
  "Models of OpenSim.")

(add-to-list 'auto-mode-alist '("\\.osim\\'" . osim-mode))
(with-eval-after-load 'eglot
  (add-to-list 'eglot-server-programs '(osim-mode . ("osimlite" "lsp"))))
(when (require 'eglot nil t)
  (add-hook 'osim-mode-hook #'eglot-ensure))

(provide 'osim-mode)
;;; osim-mode.el ends here
