;;; osim-mode.el --- OpenSim: XML and tables with osimlite's language server -*- lexical-binding: t -*-
;; Emacs 29 brings eglot along; older ones find it on GNU ELPA (Debian: elpa-eglot).
;; Put this file on your load-path, and (require 'osim-mode) into your init file.

(require 'nxml-mode)

(define-derived-mode osim-mode nxml-mode "OpenSim"
  "Models of OpenSim, and setups of its tools.")

(define-derived-mode osim-table-mode fundamental-mode "OpenSim table"
  "Tables of OpenSim.")

(defun osim-setup-p ()
  "Whether this is a setup of OpenSim, and no other XML."
  (and buffer-file-name
       (string-match-p "\\.xml\\'" buffer-file-name)
       (save-excursion
         (goto-char (point-min))
         (search-forward "<OpenSimDocument" (min (point-max) 4000) t))))

(add-to-list 'auto-mode-alist '("\\.\\(osim\\|omoco\\)\\'" . osim-mode))
(add-to-list 'auto-mode-alist '("\\.\\(sto\\|mot\\|trc\\)\\'" . osim-table-mode))
(add-to-list 'magic-mode-alist '(osim-setup-p . osim-mode))
(with-eval-after-load 'eglot
  (add-to-list 'eglot-server-programs '((osim-mode osim-table-mode) . ("osimlite" "lsp"))))
(when (require 'eglot nil t)
  (add-hook 'osim-mode-hook #'eglot-ensure)
  (add-hook 'osim-table-mode-hook #'eglot-ensure))

(provide 'osim-mode)
;;; osim-mode.el ends here
